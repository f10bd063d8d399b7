#!/usr/bin/env python3
"""Tests a session of live agents as a user runs it: one reads examples/sensor_source until Ctrl-C, one has no sensors and a duration.
PYTHONPATH has pangea-python.

live_session_test.py BIN RECORDING WORK
"""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PORT = 20000 + os.getpid() % 10000
BUS = f"udpm://239.255.76.67:{PORT + 2}?ttl=0&recv_buf_size=4194304"  # docs/sessions.md: the first agent's
START_TIMEOUT_S, END_TIMEOUT_S = 40, 60


def wait_for(text, file):
    end = time.monotonic() + START_TIMEOUT_S
    while text not in file.read_text():
        assert time.monotonic() < end, f"no '{text}' in: {file.read_text()}"
        time.sleep(0.2)


def main(programs, recording, work):
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    session_file, said, out = work / "live.yaml", work / "said.txt", work / "out"
    session_file.write_text(f"agents:\n  - {{id: 1, live: true, recording: {Path(recording).resolve()}}}\n"
                            "  - {id: 2, live: true, duration: 2}\n")
    with said.open("w") as stdout:
        session = subprocess.Popen([programs / "pangea-session", "run", session_file, "--out", out, "--port", str(PORT)],
                                   stdout=stdout, stderr=subprocess.STDOUT)
    try:
        wait_for(f"agent 1 is live until Ctrl-C: it takes CAMERA_1, IMU_1, IMAGE_1 on {BUS}", said)
        wait_for("agent 2 is live for 2 s", said)
        source = subprocess.run([ROOT / "examples/sensor_source/euroc_source.py", "--agent", "1", "--recording", recording, "--bus", BUS],
                                check=True, timeout=100, stdout=subprocess.PIPE, text=True)
        assert "agent 1: tracking" in source.stdout, f"the source did not hear POSE_1: {source.stdout}"
        time.sleep(2)
        assert session.poll() is None, "it ended by itself"
        assert "no pose: no image came to the odometry" in (out / "logs" / "vio_2.txt").read_text(), "agent 2 was not ended"
    finally:
        session.send_signal(signal.SIGINT)
        session.wait(END_TIMEOUT_S)
    print(said.read_text())
    assert session.returncode == 0, session.returncode
    report = json.loads((out / "report.json").read_text())
    agent = report["agents"][0]
    assert agent["coverage"] > 0.7, agent
    assert agent["ate_server_m"] < 0.1, agent
    assert "interrupted" not in said.read_text(), "Ctrl-C is how it ends"


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
