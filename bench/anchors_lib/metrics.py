"""The results of the sessions, from their report.json."""

import statistics

FIELDS = ["error_m", "error_px", "largest_jump_m", "error_at_fusion_m", "error_10s_m", "error_end_m", "error_max_m", "error_in_view_m",
          "error_in_view_share"]


def was_shown(agent):
    return agent.get("shown", agent.get("error_m") is not None)


def metrics(report, placed):
    """Median and worst value of each field, over all anchors that the other agent shows."""
    anchors = report.get("anchors", [])
    seen = [agent for anchor in anchors for agent in anchor["agents"] if was_shown(agent)]
    names = [anchor["name"] for anchor in anchors]
    found = {"placed": sum(anchor.get("placed", True) for anchor in anchors), "shown": len(seen),
             "lost": placed - len(seen), "doubled": len(names) - len(set(names)), "localised_s": report.get("localised_s")}
    for field in FIELDS:
        values = [agent[field] for agent in seen if agent.get(field) is not None]
        found[field] = {"median": statistics.median(values), "worst": max(values), "anchors": len(values)} if values else None
    return found


def number(value):
    return "–" if value is None else f"{value['median']:.3f}; {value['worst']:.3f}"


def table(found):
    lines = ["| session | shown | error m | px | at fusion m | 10 s later m | at the end m | largest jump m |",
             "|---|---|---|---|---|---|---|---|"]
    for name, f in found.items():
        if f is None:
            lines.append(f"| {name} | failed | | | | | | |")
            continue
        cells = [f["error_m"], f["error_px"], f["error_at_fusion_m"], f["error_10s_m"], f["error_end_m"],
                 f["largest_jump_m"]]
        lines.append(f"| {name} | {f['shown']} | " + " | ".join(number(cell) for cell in cells) + " |")
    for name, f in found.items():
        if f and (view := f["error_in_view_m"]):
            lines.append(f"\n{name}, in agent 2's image: {view['anchors']}: {number(view)} m, {number(f['error_in_view_share'])} of the distance.")
        if f and f["localised_s"]:
            lines.append(f"\n{name}: agent 2 shows the first {f['localised_s']:.1f} s after its first pose.")
    return "\n".join(lines) + "\n\nMedian; worst, over the anchors as the other agent shows them.\n"
