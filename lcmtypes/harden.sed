# Adds checks that lcm-gen 1.3.1 lacks in its C++ decoders. They resize an array before they compare
# its count with the rest of the payload: a negative count throws, a huge one first allocates
# gigabytes. (Every element takes at least one byte, so that the rest bounds the count.) They also
# accept a string length below 1: with INT_MIN they read two gigabytes beyond the end.
s/^( *)(this->\w+\.resize\((this->\w+)\);)$/\1if(\3 < 0 || \3 > maxlen - pos) return -1;\n\1\2/
s/if\((__\w+) > maxlen - pos\) return -1;/if(\1 < 1 || \1 > maxlen - pos) return -1;/
