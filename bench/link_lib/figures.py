"""What a row's session came to: from its report and its captured logs."""

import json
import statistics
import struct

from link_lib.plan import ROWS, is_budget

LCM_SYNC = 0xEDA1DA01
MAX_ATE_CHANGE_M = 0.005


def events(log):
    """Of an LCM log: wall clock in microseconds, channel, data. Ends at the first event that is not whole."""
    with open(log, "rb") as file:
        while len(header := file.read(28)) == 28:
            sync, _, utime, channel_bytes, data_bytes = struct.unpack(">IqqII", header)
            channel, data = file.read(channel_bytes), file.read(data_bytes)
            if sync != LCM_SYNC or len(data) < data_bytes:
                return
            yield utime, channel.decode(errors="replace"), data


def keyframes(log):
    """(agent, map, seq): (when it was logged, its own time, encoded bytes), of the first time each was said."""
    found = {}
    for utime, channel, data in events(log):
        if channel.startswith("KEYFRAME_"):
            agent, opened, seq, own = struct.unpack_from(">8xiqiq", data)  # behind the type's fingerprint
            found.setdefault((agent, opened, seq), (utime, own, len(data)))
    return found


def status_counters(data):
    """The counters of an encoded status_t."""
    at = 8  # behind the type's fingerprint

    def take(form):
        nonlocal at
        values = struct.unpack_from(">" + form, data, at)
        at += struct.calcsize(">" + form)
        return values[0]

    def take_text():
        nonlocal at
        size = take("i")
        at += size
        return data[at - size:at - 1].decode()

    def take_counters():
        return {take_text(): take("q") for _ in range(take("h"))}

    take_text()
    take("qqi")
    take_text()
    take("5q4f")
    take_counters()  # what was refused
    return take_counters()


def uplink_statuses(log, agent):
    """Of an agent's log: (wall clock, counters) of its uplink."""
    return [(utime, status_counters(data)) for utime, channel, data in events(log) if channel == f"STATUS_uplink_{agent}"]


def rungs(statuses):
    """Mean and highest rung of an uplink under a budget."""
    seen = [counters["rung"] for _, counters in statuses if "rung" in counters]
    return (statistics.mean(seen), max(seen)) if seen else (0, 0)


def to_play(agent, seconds):
    """What the player of an agent's stored keyframes plays."""
    stored = keyframes(agent.keyframes)
    first = min(own for _, own, _ in stored.values())
    return {id: size for id, (_, own, size) in stored.items() if not seconds or own - first <= 1e6 * seconds}


class Row:
    def __init__(self, job, options):
        self.name = job.name
        session = job.folder / "session"
        report = json.loads((session / "report.json").read_text())
        stored = {}
        for agent in options.agents:
            stored.update(to_play(agent, options.seconds))
        journal = set(keyframes(session / "journal.lcm"))
        sent = {}
        for agent in options.agents:
            sent.update(keyframes(session / f"agent_{agent.id}.lcm"))
        arrived = keyframes(session / "session.lcm")
        late = sorted(1e-6 * (arrived[id][0] - sent[id][0]) for id in arrived if id in sent)
        begin = next(events(session / "session.lcm"))[0]
        first_sent = 1e-6 * (min(utime for utime, _, _ in sent.values()) - begin)
        fused = [c["session_s"] for c in report["fused_at"] if c["change"] == "fused"]
        size = sum(stored.values())
        statuses = {agent.id: uplink_statuses(session / f"agent_{agent.id}.lcm", agent.id) for agent in options.agents}
        lasts = {id: 1e-6 * (max(u for key, (u, _, _) in sent.items() if key[0] == id) -
                             min(u for key, (u, _, _) in sent.items() if key[0] == id)) for id in statuses}
        self.figures = {
            "groups": [group["agents"] for group in report["groups"]],
            "ate_joint_m": report["ate_joint_m"],
            "keyframes_sent": len(stored),
            "keyframes_journalled": len(journal & set(stored)),
            "fused_s": round(fused[0] - first_sent, 1) if fused else None,
            "late_median_s": round(statistics.median(late), 3) if late else None,
            "late_p99_s": round(late[int(0.99 * (len(late) - 1))], 3) if late else None,
            "bytes_up": sum(agent["bytes_up"] for agent in report["agents"]),
            "bytes_up_over_keyframes": round(sum(agent["bytes_up"] for agent in report["agents"]) / size, 3),
            "bytes_down": sum(agent["bytes_down"] for agent in report["agents"]),
            "kb_per_s": [round(1e-3 * agent["bytes_up"] / max(1, lasts[agent["id"]]), 1) for agent in report["agents"]],
            "rungs": [tuple(round(rung, 1) for rung in rungs(statuses[agent.id])) for agent in options.agents],
        }

    def ate_change(self, rows):
        ates = [row.figures["ate_joint_m"] for row in rows if row.name in (self.name, "perfect")]
        return None if len(ates) < 2 or None in ates else self.figures["ate_joint_m"] - ates[0]

    def passes(self, rows):
        whole = self.figures["keyframes_journalled"] == self.figures["keyframes_sent"]
        if self.name == "perfect" or all(row.name != "perfect" for row in rows):
            return whole
        perfect = next(row for row in rows if row.name == "perfect")
        change = self.ate_change(rows)
        same = self.figures["groups"] == perfect.figures["groups"]
        if is_budget(ROWS[self.name]):  # what it costs is said, not judged
            return whole and same
        return whole and same and change is not None and abs(change) <= MAX_ATE_CHANGE_M


def number(value, form):
    return "–" if value is None else format(value, form)


def table(rows):
    head = ["link", "keyframes delivered", "groups", "joint ATE m", "change mm", "fused after s",
            "keyframe late s: median", "p99", "MB up", "of the keyframes", "kB/s up", "rung: mean, highest", "MB down", "pass"]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for row in rows:
        f = row.figures
        change = row.ate_change(rows)
        groups = ", ".join("+".join(map(str, group)) for group in f["groups"])
        cells = [ROWS[row.name] or "perfect", f"{f['keyframes_journalled']} of {f['keyframes_sent']}", groups,
                 number(f["ate_joint_m"], ".4f"), number(None if change is None else 1000 * change, "+.2f"),
                 number(f["fused_s"], ".1f"), number(f["late_median_s"], ".2f"), number(f["late_p99_s"], ".2f"),
                 number(1e-6 * f["bytes_up"], ".2f"), number(f["bytes_up_over_keyframes"], ".3f"),
                 ", ".join(f"{rate:.1f}" for rate in f["kb_per_s"]),
                 "; ".join(f"{mean}, {high}" for mean, high in f["rungs"]) if any(high for _, high in f["rungs"]) else "–",
                 number(1e-6 * f["bytes_down"], ".2f"), "pass" if row.passes(rows) else "missed"]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"
