"""Starts of a server as a table."""


def seconds(process):
    return "never" if process["ready_s"] is None else f"{process['ready_s']:.1f}"


def row(start):
    processes = start["processes"].values()
    last = "never" if any(p["ready_s"] is None for p in processes) else f"{max(p['ready_s'] for p in processes):.1f}"
    cells = [f"{start['keyframes']}, {start['start']}", last]
    cells += [f"{seconds(p)}; {p['cpu_s']:.1f}; {p['memory_mb']:.0f}" for p in processes]
    return "| " + " | ".join(cells) + " |"


def table(starts):
    """A line for each start: ready, all and by process (s); CPU until it was stopped (s); memory then (MB)."""
    names = list(starts[0]["processes"])
    head = ["keyframes, start", "all ready", *names]
    return "\n".join(["| " + " | ".join(head) + " |", "|" + "---|" * len(head), *map(row, starts)]) + "\n"
