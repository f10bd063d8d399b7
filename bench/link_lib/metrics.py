"""The results of a row's session: from its report and its captured logs."""

import json
import statistics
import struct

from link_lib.plan import ROWS, is_budget, label

LCM_SYNC = 0xEDA1DA01
MAX_ATE_CHANGE_M = 0.005
LOWER_HEADERS = 28 + 8 + len("LINK_UP_1") + 1  # UDP, IP, LCM: bytes that are not in the data given to LCM


def events(log, begin=0):
    """Events of an LCM log from byte `begin` on: wall clock in microseconds, channel, data. Ends at the first incomplete event."""
    with open(log, "rb") as file:
        file.seek(begin)
        while len(header := file.read(28)) == 28:
            sync, _, utime, channel_bytes, data_bytes = struct.unpack(">IqqII", header)
            channel, data = file.read(channel_bytes), file.read(data_bytes)
            if sync != LCM_SYNC or len(data) < data_bytes:
                return
            yield utime, channel.decode(errors="replace"), data


def keyframes(log):
    """(agent, map, seq): (time in the log, its own time, encoded bytes), for the first message of each keyframe."""
    found = {}
    for utime, channel, data in events(log):
        if channel.startswith("KEYFRAME_"):
            agent, opened, seq, own = struct.unpack_from(">8xiqiq", data)  # after the type's fingerprint
            found.setdefault((agent, opened, seq), (utime, own, len(data)))
    return found


def decode_status(data):
    """An encoded status_t: its summary, pending, memory_mb, cpu_s, and the counts of refused and processed items."""
    at = 8  # after the type's fingerprint

    def take(form):
        nonlocal at
        values = struct.unpack_from(">" + form, data, at)
        at += struct.calcsize(">" + form)
        return values

    def text():
        size, = take("i")
        return take(f"{size}s")[0][:-1].decode(errors="replace")

    def counts():
        return {text(): take("q")[0] for _ in range(take("h")[0])}

    text()
    take("qqi")
    summary = text()
    _, _, pending, _, _, _, _, memory_mb, cpu_s = take("5q4f")
    return {"summary": summary, "pending": pending, "memory_mb": memory_mb, "cpu_s": cpu_s, "refused": counts(), "counters": counts()}


def statuses(log, process):
    """Every STATUS_<process>: (wall clock, decoded status)."""
    return [(utime, decode_status(data)) for utime, channel, data in events(log) if channel == f"STATUS_{process}"]


def newest(statuses):
    return statuses[-1][1] if statuses else {"cpu_s": 0, "refused": {}, "counters": {}}


def rungs(statuses):
    """Mean and highest rung of an uplink under a budget."""
    seen = [said["counters"]["rung"] for _, said in statuses if "rung" in said["counters"]]
    return (statistics.mean(seen), max(seen)) if seen else (0, 0)


def strangers(log):
    """Counts of stranger.py's messages on the server's bus: those received by a logger, which accepts all, and those that our processes accepted."""
    heard = sum(channel == "RESEND_REQUEST" and not any(data) for _, channel, data in events(log))
    last = {channel: decode_status(data) for _, channel, data in events(log) if channel.startswith("STATUS_")}
    taken = sum(said["refused"].get("resend_request_t does not decode", 0) for said in last.values())
    return {"strangers_heard_by_logger": heard, "strangers_taken": taken}


def to_play(agent, seconds):
    """The keyframes that the player of an agent plays."""
    stored = keyframes(agent.keyframes)
    first = min(own for _, own, _ in stored.values())
    return {id: size for id, (_, own, size) in stored.items() if not seconds or own - first <= 1e6 * seconds}


class Row:
    def __init__(self, job, options):
        self.name, self.label = job.name, label(options, job.name)
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
        uplinks = [statuses(session / f"agent_{agent.id}.lcm", f"uplink_{agent.id}") for agent in options.agents]
        lasts = {agent.id: 1e-6 * (max(u for key, (u, _, _) in sent.items() if key[0] == agent.id) -
                                   min(u for key, (u, _, _) in sent.items() if key[0] == agent.id))
                 for agent in options.agents}
        self.metrics = {
            "groups": [group["agents"] for group in report["groups"]],
            "ate_joint_m": report["ate_joint_m"],
            "keyframes_sent": len(stored),
            "keyframes_journalled": len(journal & set(stored)),
            "fused_s": round(fused[0] - first_sent, 1) if fused else None,
            "late_median_s": round(statistics.median(late), 3) if late else None,
            "late_p99_s": round(late[int(0.99 * (len(late) - 1))], 3) if late else None,
            "rungs": [tuple(round(rung, 1) for rung in rungs(uplink)) for uplink in uplinks],
        } | self.traffic(options, session, [newest(uplink) for uplink in uplinks], lasts)
        if options.hosts:
            self.metrics |= json.loads((session / "frames.json").read_text()) | strangers(session / "session.lcm")

    @staticmethod
    def traffic(options, session, uplinks, lasts):
        """Bytes on the wire, with all headers, relative to the compressed keyframes; and the handler's counts of strangers."""
        handler = newest(statuses(session / "session.lcm", "agent_handler"))
        up = [uplink["counters"] for uplink in uplinks]

        def total(name):
            return sum(counters.get(name, 0) for counters in up)

        compressed = total("keyframe_bytes") or 1
        given_to_lcm = total("bytes_up_keyframes") - LOWER_HEADERS * total("packets_up_keyframes")
        opened = sum(handler["counters"].get(f"packets_{a.id}", 0) for a in options.agents)
        return {
            "bytes_up": total("bytes_up"),
            "bytes_down": total("bytes_down"),
            "kb_per_s": [round(1e-3 * counters.get("bytes_up", 0) / max(1, lasts[agent.id]), 1)
                         for agent, counters in zip(options.agents, up)],
            "bytes_compressed": total("keyframe_bytes"),
            "bytes_up_keyframes": total("bytes_up_keyframes"),
            "keyframes_over_compressed": round(total("bytes_up_keyframes") / compressed, 4),
            "keyframes_given_to_lcm_over_compressed": round(given_to_lcm / compressed, 4),
            "bytes_up_hellos": total("bytes_up_hellos"),
            "bytes_up_poses": total("bytes_up_poses"),
            "packets_up": total("packets_up"),
            "packets_opened": opened,
            "packets_refused": sum(handler["refused"].values()),
            "refused": handler["refused"],
            "packets_refused_by_uplinks": sum(sum(uplink["refused"].values()) for uplink in uplinks),
            "handler_cpu_s": round(handler["cpu_s"], 2),
        }

    def ate_change(self, rows):
        ates = [row.metrics["ate_joint_m"] for row in rows if row.name in (self.name, "perfect")]
        return None if len(ates) < 2 or None in ates else self.metrics["ate_joint_m"] - ates[0]

    def passes(self, rows):
        whole = self.metrics["keyframes_journalled"] == self.metrics["keyframes_sent"]
        if self.name == "perfect" or all(row.name != "perfect" for row in rows):
            return whole
        perfect = next(row for row in rows if row.name == "perfect")
        change = self.ate_change(rows)
        same = self.metrics["groups"] == perfect.metrics["groups"]
        if is_budget(ROWS.get(self.name, "")):  # the cost of a budget is shown, but not limited
            return whole and same
        if self.name == "forged":  # no packet may be accepted but those that an uplink sent
            same = same and self.metrics["packets_opened"] <= self.metrics["packets_up"]
        if self.name == "strangers":
            same = same and self.metrics["strangers_heard_by_logger"] > 0 and self.metrics["strangers_taken"] == 0
        if perfect.metrics["ate_joint_m"] is None:  # without ground truth
            return whole and same
        return whole and same and change is not None and abs(change) <= MAX_ATE_CHANGE_M


def number(value, form):
    return "–" if value is None else format(value, form)


HOST_HEAD = ("their network's MB up over the keyframes", "frames lost up, down")


def frames(metrics):
    """Counts of the hosts' network itself: all bytes sent up (with hellos), with IP headers."""
    if "frame_bytes_up" not in metrics:
        return []
    over = metrics["frame_bytes_up"] / (metrics["bytes_compressed"] or 1)
    return [f"{over:.3f}", f"{metrics['frames_lost_up']}, {metrics['frames_lost_down']}"]


def table(rows):
    head = ["link", "keyframes delivered", "groups", "joint ATE m", "change mm", "fused after s",
            "keyframe late s: median", "p99", "MB of keyframes, compressed", "their packets over it", "given to LCM",
            "kB hellos", "kB poses", "kB down", "kB/s up", "rung: mean, highest", "handler CPU s"]
    head += [*HOST_HEAD, "pass"] if any("frame_bytes_up" in row.metrics for row in rows) else ["pass"]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for row in rows:
        f = row.metrics
        change = row.ate_change(rows)
        groups = ", ".join("+".join(map(str, group)) for group in f["groups"])
        cells = [row.label, f"{f['keyframes_journalled']} of {f['keyframes_sent']}", groups,
                 number(f["ate_joint_m"], ".4f"), number(None if change is None else 1000 * change, "+.2f"),
                 number(f["fused_s"], ".1f"), number(f["late_median_s"], ".2f"), number(f["late_p99_s"], ".2f"),
                 number(1e-6 * f["bytes_compressed"], ".3f"), number(f["keyframes_over_compressed"], ".3f"),
                 number(None if "frame_bytes_up" in f else f["keyframes_given_to_lcm_over_compressed"], ".3f"), number(1e-3 * f["bytes_up_hellos"], ".1f"),
                 number(1e-3 * f["bytes_up_poses"], ".1f"), number(1e-3 * f["bytes_down"], ".1f"),
                 ", ".join(f"{rate:.1f}" for rate in f["kb_per_s"]),
                 "; ".join(f"{mean}, {high}" for mean, high in f["rungs"]) if any(high for _, high in f["rungs"]) else "–",
                 number(f["handler_cpu_s"], ".1f"), *frames(f), "pass" if row.passes(rows) else "missed"]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"
