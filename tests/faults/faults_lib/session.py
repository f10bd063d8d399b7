"""A session of stored keyframes with faults: its file, its run, and its results."""

import json
import os
import random
import struct
import subprocess
from dataclasses import dataclass
from pathlib import Path

from link_lib.metrics import events, statuses

SERVER = ("agent_handler", "place_recognition", "inter_map_ba", "fusion", "posegraph", "global_ba", "map_points",
          "anchors")
SECOND_STARTS_AFTER_S = 2  # so that the same map is the first in every journal


@dataclass
class Agent:
    id: int
    log: Path  # of keyframes; empty: vio runs on the recording
    recording: Path = None
    link: str = ""


def random_kills(seed, count, begin_s, end_s, agents):
    """`count` kills of server processes and uplinks at random times, which depend only on the seed."""
    generator = random.Random(seed)
    names = [*SERVER, *(f"uplink_{agent.id}" for agent in agents)]
    times = sorted(generator.uniform(begin_s, end_s) for _ in range(count))
    return [f"at: {at:.2f}, kill: {generator.choice(names)}" for at in times]


def session_yaml(agents, faults, seconds=None):
    lines = ["agents:"]
    for index, agent in enumerate(agents):
        keys = [f"id: {agent.id}", f"delay: {SECOND_STARTS_AFTER_S * index}"]
        keys += [f"keyframes: {agent.log.resolve()}"] if agent.log else []
        keys += [f"recording: {agent.recording.resolve()}"] if agent.recording else []
        keys += [f"duration: {seconds:g}"] if seconds else []
        keys += [f"link: {{{agent.link}}}"] if agent.link else []
        lines.append(f"  - {{{', '.join(keys)}}}")
    lines += ["faults:", *(f"  - {{{fault}}}" for fault in faults)] if faults else []
    return "\n".join(lines) + "\n"


class Session:
    """A session that is run once in `folder`; its results are read from there."""

    def __init__(self, folder, bin, agents, faults=(), seconds=None, rate="1", environment=None):
        self.environment = os.environ | (environment or {})
        self.folder, self.bin, self.agents, self.out = folder, Path(bin), agents, folder / "out"
        folder.mkdir(parents=True, exist_ok=True)
        file = folder / "session.yaml"
        file.write_text(session_yaml(agents, faults, seconds))
        self.command = [str(self.bin / "pangea-session"), "run", str(file), "--out", str(self.out), "--rate", rate]
        self.journal = self.out / "journal.lcm"

    def start(self):
        with open(self.folder / "session.txt", "w") as output:
            return subprocess.Popen(self.command, stdout=output, stderr=subprocess.STDOUT, env=self.environment)

    def run(self):
        self.exit_code = self.start().wait()
        return self

    def report(self, folder=None):
        return json.loads(((folder or self.out) / "report.json").read_text())

    def groups(self):
        return sorted(sorted(group["agents"]) for group in self.report()["groups"])

    def restarts(self):
        return {name: process.get("restarts", 0) for name, process in self.report()["processes"].items()}

    def summaries(self, process):
        """The summaries in a server process's statuses."""
        return [said["summary"] for _, said in statuses(self.out / "session.lcm", process)]

    def replay(self, name):
        folder = self.folder / name
        subprocess.run([str(self.bin / "pangea-session"), "replay", str(self.journal), "--out", str(folder)],
                       check=True, stdout=subprocess.DEVNULL)
        return folder


def played(agents, seconds=None):
    """(agent, map, seq): encoded bytes, for the stored keyframes that are played."""
    found = {}
    for agent in agents:
        of_agent = {id: (own, data) for id, own, data in whole_keyframes(agent.log) if id[0] == agent.id}
        first = min(own for own, _ in of_agent.values())
        found.update({id: data for id, (own, data) in of_agent.items() if not seconds or own - first <= 1e6 * seconds})
    return found


def whole_keyframes(log):
    """(agent, map, seq), its own time, encoded bytes: for every keyframe in the log."""
    for _, channel, data in events(log):
        if channel.startswith("KEYFRAME_"):
            agent, opened, seq, own = struct.unpack_from(">8xiqiq", data)
            yield (agent, opened, seq), own, data


def positions(tum):
    """time: (x, y, z) of a trajectory."""
    rows = (line.split() for line in Path(tum).read_text().splitlines() if line and line[0] != "#")
    return {row[0]: tuple(map(float, row[1:4])) for row in rows}


def rms_m(tum, other):
    """Root mean square distance between the keyframes of two trajectories; infinite if the keyframes differ."""
    a, b = positions(tum), positions(other)
    if a.keys() != b.keys() or not a:
        return float("inf")
    squares = [sum((p - q) ** 2 for p, q in zip(a[time], b[time])) for time in a]
    return (sum(squares) / len(squares)) ** 0.5


def same_files(folder, other):
    """Whether two replays have written the same bytes; the time that each took is not compared."""
    names, others = (set(os.listdir(each)) - {"timing.json"} for each in (folder, other))
    return names == others and all((folder / name).read_bytes() == (other / name).read_bytes() for name in names)
