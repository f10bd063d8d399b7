# What lcm-gen's Python lacks. Names and defaults in Python only: the fingerprint is a number there.
# A field called as a keyword is from_ instead.
s/\bself\.from\b/self.from_/g
/__slots__/s/"from"/"from_"/
# Byte arrays begin as texts, which Python 3 does not encode.
s/^( *self\.(data|descriptors)) = ""$/\1 = b""/
s/^( *self\.descriptor) = ""$/\1 = bytes(32)/
