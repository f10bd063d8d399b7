#!/usr/bin/env python3
"""Tests a delayed pangea-vio: in real time it drops images and reports it, at --rate max it drops none.

lag_test.py BIN RECORDING WORK
"""

import re
import signal
import subprocess
import sys
import time
from pathlib import Path

HELD_UP_S = 4
MAX_LAG_S = 1


def run(programs, recording, tum, rate):
    """Returns poses, stderr and seconds; the program is stopped for a while in the middle."""
    begin = time.monotonic()
    vio = subprocess.Popen([programs / "pangea-vio", "--agent", "1", "--bus", "none", "--recording", recording, "--rate", rate,
                            "--duration", "10", "--out-tum", tum], stderr=subprocess.PIPE, text=True)
    while not tum.exists() or tum.stat().st_size == 0:  # until it has started
        assert vio.poll() is None, vio.stderr.read()
        time.sleep(0.01)
    vio.send_signal(signal.SIGSTOP)
    time.sleep(HELD_UP_S)
    vio.send_signal(signal.SIGCONT)
    complaints = vio.communicate(timeout=100)[1]
    assert vio.returncode == 0, complaints
    return len(tum.read_text().splitlines()), complaints, time.monotonic() - begin


def main(programs, recording, work):
    work.mkdir(parents=True, exist_ok=True)
    results = {}
    for rate in ("1", "max"):
        tum = work / f"rate_{rate}.tum"
        tum.unlink(missing_ok=True)
        results[rate] = run(programs, recording, tum, rate)
        print(rate, *results[rate])
    told = re.search(r"agent 1 cannot keep up: lag [\d.]+ s, (\d+) images dropped of \d+", results["1"][1])
    assert told, "it does not say that it cannot keep up"
    assert "cannot keep up" not in results["max"][1]
    missing = results["max"][0] - results["1"][0]
    frames_per_s = 20
    assert missing >= 0.9 * (HELD_UP_S - MAX_LAG_S) * frames_per_s, f"{missing} poses fewer than with all images"
    assert results["1"][2] < 10 + HELD_UP_S - 0.5, f"{results['1'][2]:.1f} s for 10 s: it fell behind and stayed so"


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
