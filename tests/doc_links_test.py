#!/usr/bin/env python3
"""Tests that things named in the documentation exist: linked files, source files, scripts and programs in commands."""

import re
import subprocess
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGES = [ROOT / name for name in subprocess.run(
    ["git", "-C", ROOT, "ls-files", "-z", "--cached", "--others", "--exclude-standard", "*.md"],
    capture_output=True, text=True, check=True).stdout.split("\0") if name and (ROOT / name).exists()]


def without_code(text):
    return re.sub(r"```.*?```|`[^`]*`", "", text, flags=re.S)


def anchors_of(page):
    """The anchors of the page's headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(), flags=re.M)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


class DocLinks(unittest.TestCase):
    def test_links(self):
        count, anchors = 0, 0
        for page in PAGES:
            for file, anchor in re.findall(r"\]\(([^)#\s]*)#?([^)\s]*)[^)]*\)", without_code(page.read_text())):
                target = page.parent / file if file else page
                link = f"{page.relative_to(ROOT)}: {file}#{anchor}"
                if re.match(r"\w+:", file):
                    continue
                self.assertTrue(target.exists(), link)
                if anchor:
                    self.assertIn(anchor, anchors_of(target), link)
                count += 1
                anchors += bool(anchor)
        self.assertGreater(count, 30)
        self.assertGreater(anchors, 10)

    def test_sources_named(self):
        """Sources are named by their path, or by its end."""
        sources = ["/" + name for name in subprocess.run(
            ["git", "-C", ROOT, "ls-files", "*.h", "*.cc", "*.py"], capture_output=True, text=True, check=True).stdout.split()]
        count = 0
        for page in PAGES:
            for name in re.findall(r"`([\w/]+\.(?:cc|h|py))`", page.read_text()):
                self.assertTrue(any(source.endswith("/" + name) for source in sources), f"{page.relative_to(ROOT)}: {name}")
                count += 1
        self.assertGreater(count, 100)

    def test_scripts_and_session_files_named(self):
        for page in [ROOT / "README.md", *(ROOT / "docs").glob("*.md")]:
            for name in re.findall(r"(?<![\w/.-])((?:scripts|sessions|tests)/[\w/]+(?:\.\w+)?)", page.read_text()):
                self.assertTrue((ROOT / name.rstrip("/")).exists(), f"{page.name}: {name}")

    def test_programs_named(self):
        cmake = " ".join(path.read_text() for path in ROOT.glob("*/*/CMakeLists.txt"))
        known = set(re.findall(r"(?:pangea_program|add_executable)\((pangea-[\w-]+)", cmake)) | {"pangea-nats-config", "pangea-spy"}
        for page in [ROOT / "README.md", *(ROOT / "docs").glob("*.md")]:
            for name in re.findall(r"bin/(pangea-[\w-]+)", page.read_text()):
                self.assertIn(name, known, page.name)


if __name__ == "__main__":
    unittest.main()
