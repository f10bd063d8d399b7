"""The sessions: two agents, anchors spread over agent 1's image and time, and the faults."""

import json
import re

from real_lib.plan import seconds

# The faults of each session.
CONDITIONS = ("good", "lossy", "killed", "next_day")
# The server's processes that are killed in turn, ten times.
KILLED = ["anchors", "agent_handler", "posegraph", "fusion", "place_recognition"] * 2
LOSSY = {"loss": 0.2, "delay_ms": 2000}

# Places in the image at which people tap, as shares of its width and height.
SPOTS = [(0.5, 0.5), (0.35, 0.6), (0.65, 0.45), (0.5, 0.7), (0.6, 0.6)]
# Times after the start-up, and early enough to reach agent 2 while it walks, even if keyframes are 20 s late.
FIRST_S, LAST = 6, 0.6
LAST_KEYFRAME_S = 1  # an anchor is placed when the next keyframe has arrived


def image_size(recording):
    """(width, height), from sensor.yaml."""
    text = (recording / "mav0/cam0/sensor.yaml").read_text()
    found = re.search(r"^resolution: *\[ *(\d+) *, *(\d+) *\]", text, re.MULTILINE)
    return int(found[1]), int(found[2])


def anchors(count, times, size):
    """Anchors spread over these seconds of agent 1's recording, and over its image."""
    return [{"agent": 1, "at": round(times[i * (len(times) - 1) // max(count - 1, 1)], 3), "name": f"anchor_{i + 1}",
             "pixel": [round(share * length) for share, length in zip(SPOTS[i % len(SPOTS)], size)]}
            for i in range(count)]


def evenly(begin, end, count):
    return [begin + i * (end - begin) / max(count - 1, 1) for i in range(count)]


def two_recordings(options):
    """The agents, and the times at which agent 1 places anchors."""
    first, second = (str(recording.resolve()) for recording in options.recordings)
    agents = [{"id": 1, "recording": first, "duration": options.seconds},
              {"id": 2, "recording": second, "duration": options.seconds, "delay": 3}]
    return agents, evenly(FIRST_S, LAST * options.seconds, options.anchors), options.seconds


def next_day_yaml(options):
    """Two session files: agent 1 alone, then agent 2 alone."""
    (first, second), times, _ = two_recordings(options)
    del second["delay"]
    placed = anchors(options.anchors, times, image_size(options.recordings[0]))
    return [json.dumps(session, indent=1) + "\n" for session in ({"agents": [first], "anchors": placed}, {"agents": [second]})]


def cut_in_two(options, truth):
    """One recording: agent 2 plays the second part after agent 1 has ended. Anchors are placed at images with known poses."""
    recording, length = options.recordings[0], seconds(options.recordings[0])
    cut = options.cut or length / 2
    (begin, end), (again, last) = [(cut, length), (0, cut)] if options.swap else [(0, cut), (cut, length)]
    agents = [{"id": 1, "recording": str(recording.resolve()), "start": begin, "duration": end - begin},
              {"id": 2, "recording": str(recording.resolve()), "start": again, "duration": last - again, "delay": end - begin}]
    times = [t for t in truth if begin + FIRST_S <= t <= end - LAST_KEYFRAME_S]
    if not times:
        raise SystemExit(f"anchors: the reference has no image of {recording} from {begin + FIRST_S:g} to {end - LAST_KEYFRAME_S:g} s")
    return agents, times, length


def session_yaml(condition, options, truth=None):
    """A session file; JSON is YAML. `truth`: for one recording that is cut in two, the seconds of images with known poses."""
    agents, times, length = two_recordings(options) if truth is None else cut_in_two(options, truth)
    for agent in agents:
        agent.update({"link": LOSSY} if condition == "lossy" else {})
    session = {"agents": agents, "anchors": anchors(options.anchors, times, image_size(options.recordings[0]))}
    if condition == "killed":
        session["faults"] = [{"at": round(t, 1), "kill": process} for t, process in zip(evenly(10, length - 5, len(KILLED)), KILLED)]
    return json.dumps(session, indent=1) + "\n"
