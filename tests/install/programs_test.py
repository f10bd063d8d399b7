#!/usr/bin/env python3
"""Tests that `cmake --install` needs only files that the target `programs` builds: programs_test.py BUILD_DIR"""

import os
import re
import subprocess
import sys
from pathlib import Path


def ninja(build, *arguments):
    return subprocess.run(["ninja", "-C", str(build), *arguments], check=True, capture_output=True, text=True).stdout.splitlines()


def installed(build):
    """Files and folders of the build tree that are installed and must exist."""
    for folder, _, files in os.walk(build):  # passes over what other tests remove meanwhile
        if "cmake_install.cmake" in files:
            for command in re.findall(r"file\(INSTALL ([^)]*)\)", (Path(folder) / "cmake_install.cmake").read_text()):
                if " OPTIONAL" not in command:
                    yield from (path for path in re.findall(r'"([^"]*)"', command) if path.startswith(f"{build}/"))


def main(build):
    outputs = {build / line.split(": ")[0] for line in ninja(build, "-t", "targets", "all") if ": " in line}
    graph = "\n".join(ninja(build, "-t", "graph", "programs"))  # unlike `-t inputs`, it includes order-only inputs
    made = {build / label for label in re.findall(r'label="([^"]+)"', graph)}
    wanted = [Path(path) for path in installed(build)]
    assert len(wanted) > 50, f"only {len(wanted)} installed files were found"
    needed = {output for output in outputs for path in wanted if output == path or path in output.parents}
    missing = sorted(str(path) for path in needed - made)
    assert not missing, "installed, but not made by `programs`:\n" + "\n".join(missing)
    print(f"{len(needed)} files that are built and installed, all of them by `programs`")


if __name__ == "__main__":
    main(Path(sys.argv[1]).resolve())
