#!/usr/bin/env python3
"""Tests that the options in the documentation exist: each `pangea-... --option` is compared with the program's --help.

    doc_options_test.py BIN
"""

import functools
import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
PAGES = [ROOT / name for name in subprocess.run(
    ["git", "-C", ROOT, "ls-files", "*.md"], capture_output=True, text=True, check=True).stdout.split()]
COMMAND = re.compile(r"\b(pangea-[a-z0-9-]+)([^\n`|;#]*)")
# These are scripts, the WebAssembly, and a systemd unit.
NOT_BUILT = {"pangea-agent", "pangea-nats-config", "pangea-spy", "pangea-worker"}
OPTION = re.compile(r"(?<![\w-])--[a-z][a-z0-9-]*")


@functools.cache
def help_of(*command):
    return subprocess.run([*command, "--help"], check=True, capture_output=True, text=True).stdout


def is_subcommand(program, word):
    return re.search(rf"(?m)^  {re.escape(word)}\b", help_of(program).partition("Subcommands:")[2]) is not None


def main():
    binaries = pathlib.Path(sys.argv[1])
    wrong, count = [], 0
    for page in PAGES:
        for program, arguments in COMMAND.findall(page.read_text()):
            if program in NOT_BUILT:
                continue
            program = str(binaries / program)
            if not os.access(program, os.X_OK):
                wrong.append(f"{page.relative_to(ROOT)}: there is no {os.path.basename(program)}")
                continue
            words = arguments.split()
            command = (program, words[0]) if words and is_subcommand(program, words[0]) else (program,)
            for option in OPTION.findall(arguments):
                count += 1
                if option not in OPTION.findall(help_of(*command)):
                    wrong.append(f"{page.relative_to(ROOT)}: {' '.join([os.path.basename(program), *command[1:]])} has no {option}")
    assert count > 50, "the pages are read wrongly"
    sys.exit("\n".join(wrong) or 0)


if __name__ == "__main__":
    main()
