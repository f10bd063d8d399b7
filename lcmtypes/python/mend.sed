# Corrects the Python code that lcm-gen writes. Only names and defaults change: the fingerprint is
# a fixed number in that code. The field `from`, a keyword in Python, is named from_.
s/\bself\.from\b/self.from_/g
/__slots__/s/"from"/"from_"/
# lcm-gen initialises byte arrays with a str, which Python 3 cannot encode as bytes.
s/^( *self\.(data|descriptors)) = ""$/\1 = b""/
s/^( *self\.descriptor) = ""$/\1 = bytes(32)/
