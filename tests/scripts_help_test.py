#!/usr/bin/env python3
"""Tests that --help of each script that users start prints its purpose and does nothing else, even if the real run takes long; and what
scripts/spy says without a display."""

import os
import subprocess
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
FOLDERS = ["scripts", "bench"]
NOT_BY_HAND = {"scripts/wasm_libraries"}  # its output is a folder's name, for scripts/build


def scripts():
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).iterdir()):
            if path.is_file() and path.stat().st_mode & 0o100 and not path.suffix and str(path.relative_to(ROOT)) not in NOT_BY_HAND:
                yield path


class ScriptsHelp(unittest.TestCase):
    def test_help(self):
        count = 0
        for path in scripts():
            with self.subTest(path.name):
                text = path.read_text()
                # The text is checked before the script is run: one without help would install packages, or build for half an hour.
                first = next(line for line in text.splitlines() if line and not line.startswith(("#", "set ")))
                self.assertTrue("argparse" in text if "python" in text.splitlines()[0] else first.endswith('scripts/usage"')
                                or first == '. "$(dirname "$0")/usage"', f"{path}: no --help")
                shown = subprocess.run([path, "--help"], capture_output=True, text=True, timeout=20, cwd="/", check=True).stdout
                self.assertIn(path.name, shown)
            count += 1
        self.assertGreater(count, 20)

    def test_spy_without_display(self):
        environment = {name: value for name, value in os.environ.items() if name != "DISPLAY"}
        for path in (ROOT / "scripts/spy", ROOT / "packaging/pangea-spy"):
            told = subprocess.run([path], capture_output=True, text=True, timeout=20, env=environment)
            self.assertEqual(told.returncode, 1, path)
            self.assertRegex(told.stderr, r"\Apangea-spy: there is no display .*\n\Z")
            self.assertEqual(told.stdout, "")


if __name__ == "__main__":
    unittest.main()
