# What lcm-gen 1.3.1 forgets in its C++ decoders. A count is obeyed before it is compared with what is left of the payload:
# a negative one throws, a huge one allocates gigabytes first. A string's length may be less than 1, and INT_MIN reads
# two gigabytes beyond the end. Every element takes at least a byte.
s/^( *)(this->\w+\.resize\((this->\w+)\);)$/\1if(\3 < 0 || \3 > maxlen - pos) return -1;\n\1\2/
s/if\((__\w+) > maxlen - pos\) return -1;/if(\1 < 1 || \1 > maxlen - pos) return -1;/
