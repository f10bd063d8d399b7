#!/usr/bin/env python3
"""Tests examples/sensor_source as a user runs it: a recording in real time into pangea-vio --live. PYTHONPATH has pangea-python.

sensor_source_test.py BIN RECORDING WORK
"""

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
URL = f"udpm://239.255.76.67:{20000 + os.getpid() % 10000}?ttl=0&recv_buf_size=4194304"
AGENT = "3"


def main(programs, recording, work):
    work.mkdir(parents=True, exist_ok=True)
    tum = work / "vio.tum"
    vio = subprocess.Popen([programs / "pangea-vio", "--live", "--agent", AGENT, "--bus", URL, "--out-tum", tum])
    try:
        time.sleep(1)
        source = subprocess.run([ROOT / "examples/sensor_source/euroc_source.py", "--agent", AGENT, "--recording", recording,
                                 "--bus", URL], capture_output=True, text=True, timeout=100)
        time.sleep(1)
    finally:
        vio.send_signal(signal.SIGINT)
        vio.wait(20)
    print(source.stdout, source.stderr)
    assert source.returncode == 0, "the source failed"
    assert re.search(rf"agent {AGENT}: tracking", source.stdout), "it did not hear POSE_3"
    result = subprocess.run([programs / "pangea-eval", "ate", tum, recording, "--json", work / "ate.json"],
                            capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    error = json.loads((work / "ate.json").read_text())["yaw"]["ate_m"]
    print(f"{error['count']} poses, ATE {error['rmse']:.3f} m")
    images = (Path(recording) / "mav0/cam0/data.csv").read_text().count(".png")
    assert error["count"] > 0.7 * images, f"poses of {error['count']} of {images} images"
    assert error["rmse"] < 0.1, error["rmse"]


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
