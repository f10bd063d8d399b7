"""Memory that the processes need per keyframe: in a whole session, and for many keyframes through the link alone."""

import shutil
import time

from faults_lib.checks import Row, print_rows
from faults_lib.offline import Link, copies, memory_mb
from faults_lib.session import Session, whole_keyframes
from link_lib.metrics import keyframes, statuses

LINK_KEYFRAMES = 20000  # a walk of four hours
PLAYED_PER_S = 100
# A keyframe has 26 kB; for a delivered one the link keeps its place in the journal, some 150 bytes.
MAX_LINK_KB = 1


class Samples:
    """Resident memory (MB) of a process as a function of the number of keyframes."""

    def __init__(self):
        self.points = []

    def add(self, keyframes, mb):
        self.points.append((keyframes, mb))

    def at(self, share):
        """Memory (MB) when this share of the keyframes had arrived."""
        wanted = share * self.points[-1][0]
        return next(mb for keyframes, mb in self.points if keyframes >= wanted)

    def kb_per_keyframe(self, begin):
        """Growth per keyframe (kB) from this share of the keyframes to the end, when all work is done."""
        last, mb = self.points[-1]
        return 1e3 * (mb - self.at(begin)) / ((1 - begin) * last)


def table(samples):
    print("\n| process | MB at the start | at 1/4 | at 1/2 | at 3/4 | at the end | kB a keyframe | in the 2nd half |")
    print("|---|---|---|---|---|---|---|---|")
    for name, process in samples.items():
        shares = " | ".join(f"{process.at(share):.1f}" for share in (0, 0.25, 0.5, 0.75))
        print(f"| {name} | {shares} | {process.points[-1][1]:.1f} | {process.kb_per_keyframe(0):.2f} | {process.kb_per_keyframe(0.5):.2f} |")


def flat(name, process):
    """In the second half all memory of fixed size is allocated already, so the growth is bounded."""
    growth = process.kb_per_keyframe(0.5)
    return Row(f"kB a keyframe of {name} in the 2nd half (at most {MAX_LINK_KB})", f"{growth:.2f}", growth <= MAX_LINK_KB)


def whole_session(options):
    """The server's processes need memory for the map; it is shown, but not bounded."""
    folder = options.work / "memory"
    shutil.rmtree(folder, ignore_errors=True)
    session = Session(folder, options.bin, options.agents, (), options.seconds).run()
    rows = [Row("the session's exit code", str(session.exit_code), session.exit_code == 0)]
    if not (session.out / "report.json").exists():
        return rows
    uplinks = [f"uplink_{agent.id}" for agent in options.agents]
    servers = [name for name in session.report()["processes"] if name not in uplinks]
    arrived = arrivals(session.out / "session.lcm")
    logs = [(name, session.out / "session.lcm") for name in servers]
    logs += [(name, session.out / f"agent_{name.split('_')[1]}.lcm") for name in uplinks]
    samples = {}
    for name, log in logs:
        process = Samples()
        for utime, said in statuses(log, name):
            process.add(sum(time <= utime for time in arrived), said["memory_mb"])
        if process.points:
            samples[name] = process
    table(samples)
    return rows + [flat(name, samples[name]) for name in uplinks]


def arrivals(log):
    """Wall-clock time at which each keyframe first arrived on the server's bus."""
    return sorted(utime for utime, _, _ in keyframes(log).values())


def long_link(options):
    """Keyframes through one uplink and the handler; those of hours are sent in minutes."""
    agent = options.agents[0]
    link = Link(options.work / "memory_link", options.bin, agent.id)
    log = link.folder / "stored.lcm"
    made = copies(log=agent.log, agent=agent.id, count=LINK_KEYFRAMES, out=log)
    samples = {"uplink": Samples(), "agent_handler": Samples()}
    try:
        handler, uplink = link.handler(), link.uplink()
        time.sleep(1)
        player, begin = link.player(log), time.time()
        while player.poll() is None:
            time.sleep(1)
            played = min(len(made), int((time.time() - begin) * PLAYED_PER_S))
            samples["uplink"].add(played, memory_mb(uplink))
            samples["agent_handler"].add(played, memory_mb(handler))
        time.sleep(2)
        journalled = len({id for id, _, _ in whole_keyframes(link.folder / "journal.lcm")})
    finally:
        link.stop()
    table(samples)
    return [Row("keyframes through the link", f"{journalled} of {len(made)}", journalled == len(made)),
            *(flat(name, process) for name, process in samples.items())]


def run(options):
    held = print_rows("memory in a session", whole_session(options))
    return print_rows(f"memory over {LINK_KEYFRAMES} keyframes through one uplink", long_link(options)) and held
