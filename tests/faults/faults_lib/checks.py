"""Comparisons of a disturbed session with the undisturbed one, as rows: claim, value, whether it holds."""

import struct
from collections import Counter
from dataclasses import dataclass

from faults_lib.session import played, rms_m, same_files, whole_keyframes
from link_lib.metrics import events

MAX_CHANGE_M = 0.005


@dataclass
class Row:
    claim: str
    value: str
    holds: bool


def acknowledged(agent_log):
    """(agent, map): the highest seq that the uplink ever reported as acknowledged on its agent's bus."""
    highest = {}
    for _, channel, data in events(agent_log):
        if channel == "HAVE":
            count, = struct.unpack_from(">8xh", data)
            maps = [struct.unpack_from(">iq", data, 10 + 12 * i) for i in range(count)]
            for i, map in enumerate(maps):
                seq, = struct.unpack_from(">i", data, 10 + 12 * count + 4 * i)
                highest[map] = max(seq, highest.get(map, -1))
    return highest


def all_acknowledged(session, agents):
    """(agent, map, seq) of every keyframe that was ever reported as acknowledged."""
    return {(id, opened, s) for agent in agents
            for (id, opened), seq in acknowledged(session.out / f"agent_{agent.id}.lcm").items() for s in range(seq + 1)}


def delivery(session, agents, seconds=None):
    """Every played keyframe is in the journal, once and unchanged; so is every keyframe that was ever acknowledged."""
    journalled, wrong = Counter(), 0
    stored = played(agents, seconds)
    for id, _, data in whole_keyframes(session.journal):
        journalled[id] += 1
        wrong += stored.get(id) != data
    promised = all_acknowledged(session, agents)
    return [
        Row("acknowledged keyframes that are missing", f"{len(promised - set(journalled))} of {len(promised)}",
            bool(promised) and promised <= set(journalled)),
        Row("keyframes in the journal", f"{len(journalled)} of {len(stored)}", set(journalled) == set(stored)),
        Row("twice in it, or not as they were sent", f"{sum(n > 1 for n in journalled.values())}, {wrong}",
            wrong == 0 and max(journalled.values(), default=0) == 1),
    ]


def same_map(session, calm):
    """Groups and error are those of the undisturbed session."""
    rows = [Row("groups", ", ".join("+".join(map(str, group)) for group in session.groups()),
                session.groups() == calm.groups())]
    return rows + same_ate(session.report()["ate_joint_m"], calm.report()["ate_joint_m"], "")


def same_ate(ate, calm, what):
    if calm is None:
        return []  # without ground truth
    change = float("inf") if ate is None else ate - calm
    return [Row(f"joint ATE{what}, m (change, mm)", f"{ate or float('nan'):.4f} ({1000 * change:+.2f})",
                abs(change) <= MAX_CHANGE_M)]


def replays(session, calm, agents):
    """A replay equals a session without kills, with the keyframes in the same order."""
    once, twice = session.replay("replay_1"), session.replay("replay_2")
    same = same_files(once, twice)
    rows = [Row("its journal replays twice to equal bytes", "yes" if same else "no", same)]
    for agent in agents:
        apart = rms_m(session.out / f"agent_{agent.id}.tum", once / f"agent_{agent.id}.tum")
        rows.append(Row(f"agent {agent.id}: rms distance from that replay, mm", f"{1000 * apart:.2f}",
                        apart <= MAX_CHANGE_M))
    return rows + same_ate(session.report(once)["ate_joint_m"], calm.report()["ate_joint_m"], " of the replay")


def kills(session, planned):
    """All planned kills happened, and no others."""
    wanted = Counter(fault.split("kill: ")[1] for fault in planned if "kill: " in fault)
    restarts = Counter(session.restarts())
    return [Row("processes killed", f"{sum(restarts.values())} of {sum(wanted.values())}", restarts == +wanted)]


def print_rows(title, rows):
    print(f"\n{title}")
    for row in rows:
        print(f"  {'pass' if row.holds else 'MISSED':7} {row.claim}: {row.value}", flush=True)
    return all(row.holds for row in rows)
