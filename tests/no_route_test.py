#!/usr/bin/env python3
"""Tests that on a machine without a multicast route a program prints a single message, with a remedy: no_route_test.py BIN"""

import subprocess
import sys
from pathlib import Path

SKIPPED = 77
WITHOUT_NETWORK = ["unshare", "--user", "--map-root-user", "--net"]

if subprocess.run([*WITHOUT_NETWORK, "true"], capture_output=True).returncode != 0:
    sys.exit(SKIPPED)  # namespaces are not permitted here
done = subprocess.run([*WITHOUT_NETWORK, Path(sys.argv[1]) / "pangea-fusion"], capture_output=True, text=True, timeout=20)
print(done.stderr)
assert done.returncode == 1, done.returncode
assert done.stderr.count("\n") == 1, "more than our own line"
assert "cannot open the bus 'udpm://" in done.stderr and "ip route add 224.0.0.0/4 dev lo" in done.stderr
