#!/usr/bin/env python3
"""A type's name must be defined only once in a namespace: two definitions in one program are undefined behaviour that no compiler reports."""

import collections
import re
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
NAMESPACE = re.compile(r"namespace ([\w:]+) \{")
TYPE = re.compile(r"(?:(?:class|struct|enum class|enum) (\w+)(?: final)?(?: :[^;]*)? \{|using (\w+) =)")


def definitions(text):
    """(namespace, name) of each type that a header defines outside of other types."""
    namespace = ""
    for line in text.splitlines():
        if begin := NAMESPACE.match(line):
            namespace = begin[1]
        elif type_ := TYPE.match(line):
            yield namespace, type_[1] or type_[2]


class OneDefinition(unittest.TestCase):
    def test_headers(self):
        where = collections.defaultdict(list)
        for folder in "modules", "bench", "tests":
            for path in (ROOT / folder).rglob("*.h"):
                if "node_modules" not in path.parts:
                    for name in definitions(path.read_text()):
                        where[name].append(str(path.relative_to(ROOT)))
        self.assertGreater(len(where), 300)
        self.assertFalse({name: paths for name, paths in where.items() if len(paths) > 1})

    def test_finds_definitions(self):
        text = "namespace a::b {\nclass C;\nclass D final : public E {\n  struct F {\n  };\n};\nenum class G { kH };\nusing I = D;\n"
        self.assertEqual([("a::b", "D"), ("a::b", "G"), ("a::b", "I")], list(definitions(text)))


if __name__ == "__main__":
    unittest.main()
