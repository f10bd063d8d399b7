#!/usr/bin/env python3
"""Tests that `cmake --install` needs only files that the target `programs` builds, and scripts/demo only `demo_programs`:
programs_test.py BUILD_DIR"""

import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def ninja(build, *arguments):
    return subprocess.run(["ninja", "-C", str(build), *arguments], check=True, capture_output=True, text=True).stdout.splitlines()


def installed(build):
    """Files and folders of the build tree that are installed and must exist."""
    for folder, _, files in os.walk(build):  # passes over what other tests remove meanwhile
        if "cmake_install.cmake" in files:
            for command in re.findall(r"file\(INSTALL ([^)]*)\)", (Path(folder) / "cmake_install.cmake").read_text()):
                if " OPTIONAL" not in command:
                    yield from (path for path in re.findall(r'"([^"]*)"', command) if path.startswith(f"{build}/"))


def made_by(build, target):
    graph = "\n".join(ninja(build, "-t", "graph", target))  # unlike `-t inputs`, it includes order-only inputs
    return {build / label for label in re.findall(r'label="([^"]+)"', graph)}


def started_by_demo():
    """The programs that scripts/demo and its session start."""
    server = (ROOT / "modules/server/server_processes.h").read_text().split("kServerProcesses")[1]
    return {"session", "sim", "vio", "uplink"} | {name.replace("_", "-") for name in re.findall(r'"(\w+)"', server)}


def main(build):
    outputs = {build / line.split(": ")[0] for line in ninja(build, "-t", "targets", "all") if ": " in line}
    made = made_by(build, "programs")
    wanted = [Path(path) for path in installed(build)]
    assert len(wanted) > 50, f"only {len(wanted)} installed files were found"
    needed = {output for output in outputs for path in wanted if output == path or path in output.parents}
    missing = sorted(str(path) for path in needed - made)
    assert not missing, "installed, but not made by `programs`:\n" + "\n".join(missing)
    started = {build / f"bin/pangea-{name}" for name in started_by_demo()}
    missing = sorted(str(path) for path in started - made_by(build, "demo_programs"))
    assert not missing and len(started) == 12, "started by scripts/demo, but not made by `demo_programs`:\n" + "\n".join(missing)
    print(f"{len(needed)} files that are built and installed, all of them by `programs`")


if __name__ == "__main__":
    main(Path(sys.argv[1]).resolve())
