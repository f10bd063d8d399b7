#!/usr/bin/env python3
"""Places an anchor by the API of pangea-anchors, and prints its pose as the map moves; Ctrl-C deletes it again.

    anchor_client.py --name kettle --position 1 2 0.5
"""

import argparse
import json
import time
import urllib.error
import urllib.request

POLL_S = 0.2


def call(url, method="GET", body=None, revision=None):
    """Returns the answer as an object. For a refusal it raises an error with the server's reason."""
    request = urllib.request.Request(url, method=method, data=None if body is None else json.dumps(body).encode())
    request.add_header("Content-Type", "application/json")
    if revision is not None:
        request.add_header("If-Match", f'"{revision}"')
    try:
        with urllib.request.urlopen(request, timeout=15) as answer:
            return json.loads(answer.read() or "null")
    except urllib.error.HTTPError as error:
        raise RuntimeError(f"{method} {url}: {error.code}: {error.read().decode()}") from None
    except OSError as error:  # this includes urllib's own errors
        raise RuntimeError(f"{method} {url}: {getattr(error, 'reason', error)}: is pangea-server running there, with --http?") from None


def group_of(server, agent):
    """The group in whose map frame the position is given: that of the agent, or of the first one if none is given."""
    agents = [each for each in call(f"{server}/v1/agents")["agents"] if agent in (None, each["id"])]
    if not agents:
        raise RuntimeError("the server has no map of this agent yet")
    return agents[0]["group"]


def show(anchor):
    if anchor["pose"] is None:
        print("not placed yet", flush=True)
        return
    x, y, z = anchor["pose"]["position"]
    sigma = max(anchor["sigma_m"])
    print(f"revision {anchor['revision']}, map of group {anchor['group']}, solve {anchor['group_revision']}: "
          f"{x:.3f} {y:.3f} {z:.3f} m, sigma {sigma:.3f} m", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--server", default="http://127.0.0.1:8090")
    parser.add_argument("--agent", type=int, help="in the map of this agent; by default of the first")
    parser.add_argument("--name", default="example")
    parser.add_argument("--position", type=float, nargs=3, default=(0, 0, 0), help="metres in the map frame")
    arguments = parser.parse_args()
    arguments.server = arguments.server.rstrip("/")

    pose = {"group": group_of(arguments.server, arguments.agent), "position": list(arguments.position)}
    anchor = call(f"{arguments.server}/v1/anchors", "POST", {"name": arguments.name, "pose": pose})
    print(f"made {anchor['id']}", flush=True)
    url = f"{arguments.server}/v1/anchors/{anchor['id']}"
    shown = None
    try:
        while True:
            anchor = call(url)
            if (anchor["revision"], anchor["pose"]) != shown:
                show(anchor)
                shown = (anchor["revision"], anchor["pose"])
            time.sleep(POLL_S)
    except KeyboardInterrupt:
        call(url, "DELETE", revision=anchor["revision"])
        print(f"deleted {anchor['id']}", flush=True)


if __name__ == "__main__":
    try:
        main()
    except (RuntimeError, OSError) as error:
        raise SystemExit(f"anchor_client.py: {error}") from None
