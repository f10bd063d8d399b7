"""The sessions: two agents, anchors spread over agent 1's image and time, and what goes wrong."""

import json
import re

# What each session suffers.
CONDITIONS = ("good", "lossy", "killed")
# The server's processes that are killed in turn, ten times.
KILLED = ["anchors", "agent_handler", "posegraph", "fusion", "place_recognition"] * 2
LOSSY = {"loss": 0.2, "delay_ms": 2000}

# Where in the image, as shares of its width and height: what people tap on.
SPOTS = [(0.5, 0.5), (0.35, 0.6), (0.65, 0.45), (0.5, 0.7), (0.6, 0.6)]
# When: after the start-up, and early enough to reach the other while it walks, also where keyframes are 20 s late.
FIRST_S, LAST = 6, 0.6


def image_size(recording):
    """(width, height), from sensor.yaml."""
    text = (recording / "mav0/cam0/sensor.yaml").read_text()
    found = re.search(r"^resolution: *\[ *(\d+) *, *(\d+) *\]", text, re.MULTILINE)
    return int(found[1]), int(found[2])


def anchors(count, seconds, size):
    step = (LAST * seconds - FIRST_S) / max(count - 1, 1)
    return [{"agent": 1, "at": round(FIRST_S + i * step, 2), "name": f"anchor_{i + 1}",
             "pixel": [round(share * length) for share, length in zip(SPOTS[i % len(SPOTS)], size)]}
            for i in range(count)]


def session_yaml(condition, options):
    """A session file; JSON is YAML."""
    link = {"link": LOSSY} if condition == "lossy" else {}
    first, second = (str(recording.resolve()) for recording in options.recordings)
    duration = {"duration": options.seconds}
    session = {
        "agents": [{"id": 1, "recording": first, **duration, **link},
                   {"id": 2, "recording": second, "delay": 3, **duration, **link}],
        "anchors": anchors(options.anchors, options.seconds, image_size(options.recordings[0])),
    }
    if condition == "killed":
        step = (options.seconds - 10) / len(KILLED)
        session["faults"] = [{"at": round(10 + i * step, 1), "kill": process} for i, process in enumerate(KILLED)]
    return json.dumps(session, indent=1) + "\n"
