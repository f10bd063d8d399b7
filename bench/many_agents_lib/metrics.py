"""The results of a run: from the captured buses and the sampled memory."""

import statistics

from link_lib.metrics import keyframes


def spread(values):
    """Median, 99th percentile and largest value, in milliseconds."""
    values = sorted(values)
    if not values:
        return None
    return {"count": len(values), "median_ms": round(1e3 * statistics.median(values), 1),
            "p99_ms": round(1e3 * values[int(0.99 * (len(values) - 1))], 1), "max_ms": round(1e3 * values[-1], 1)}


def metrics(run, options):
    arrived = keyframes(run.work / "server.lcm")
    journalled = keyframes(run.work / "journal.lcm")
    sent = {}
    for id in run.ids:
        sent.update(keyframes(run.work / f"agent_{id}.lcm"))
    late = {key: 1e-6 * (arrived[key][0] - sent[key][0]) for key in arrived if key in sent}
    begin, end = run.trouble if run.trouble else (0, 0)
    others = [key for key in late if key[0] not in (run.stopped, run.killed)]
    during = [late[key] for key in others if begin <= sent[key][0] <= (end or 0)]
    calm = [late[key] for key in others if not begin <= sent[key][0] <= (end or 0)]
    missing = [key for key in sent if key[0] != run.killed and key not in journalled]
    silent = set(run.ids) - {run.killed} - {key[0] for key in sent}
    full = [sample for sample in run.memory if sample[1] == options.agents]
    first, last = run.memory[0], (full or run.memory)[-1]
    keyframe_bytes = sum(size for _, _, size in journalled.values())
    return {
        "agents": options.agents, "keyframes_sent": len(sent), "keyframes_journalled": len(journalled),
        "missing": len(missing), "silent": sorted(silent), "keyframe_mb": round(1e-6 * keyframe_bytes, 1),
        "calm": spread(calm), "while_one_is_stopped_and_one_dead": spread(during),
        "stopped_agent": spread([late[key] for key in late if key[0] == run.stopped]),
        "handler_mb_first": round(1e-3 * first[2], 1), "handler_mb_all": round(1e-3 * last[2], 1),
        "handler_mb_end": round(1e-3 * run.memory[-1][2], 1),
        "uplink_mb_median": round(1e-3 * statistics.median(last[3]), 1), "uplink_mb_max": round(1e-3 * max(last[3]), 1),
    }


def row(name, spread_of):
    if spread_of is None:
        return f"| {name} | – | – | – | – |"
    return "| {} | {count} | {median_ms} | {p99_ms} | {max_ms} |".format(name, **spread_of)


def table(f):
    lines = ["| keyframes from sent to journalled | number | median ms | p99 ms | largest ms |", "|---|---|---|---|---|",
             row("all links well", f["calm"]),
             row("the others while one is stopped and one dead", f["while_one_is_stopped_and_one_dead"]),
             row("the stopped one, all its keyframes", f["stopped_agent"])]
    facts = (f"{f['agents']} agents, {f['keyframes_journalled']} of {f['keyframes_sent']} keyframes journalled "
             f"({f['missing']} missing of agents that were not killed), {f['keyframe_mb']} MB. Resident memory: handler "
             f"{f['handler_mb_first']} MB with the first agent, {f['handler_mb_all']} MB with all, {f['handler_mb_end']} MB at "
             f"the end; uplink {f['uplink_mb_median']} MB (largest {f['uplink_mb_max']}).")
    if f["silent"]:
        facts += f" No keyframe of the agents {', '.join(map(str, f['silent']))} was sent: see logs/player_*."
    return "\n".join(lines) + "\n\n" + facts + "\n"
