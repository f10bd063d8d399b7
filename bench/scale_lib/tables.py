"""Cities of several sizes as a table: one column for each, and the ratio of the larger one to the smaller."""

PROCESSES = ("place_recognition", "inter_map_ba", "fusion", "posegraph", "global_ba", "map_points")


def ready_s(start):
    """Seconds until all processes are ready; None if one never was."""
    times = [process["ready_s"] for process in start.values()]
    return None if None in times else max(times)


def is_good(run):
    """With recognition alone nobody is fused."""
    fused = run["recognition_alone"] or all(n > 0 for n in of_agents(run, "fused_after"))
    return fused and all(ready_s(start) is not None for start in run["starts"])


def of_processes(run, key):
    return {name: run["processes"].get(name, {}).get(key) for name in PROCESSES}


def of_agents(run, key):
    return [agent[key] for agent in run.get("agents") or []]


def number(value):
    if value is None:
        return "–"
    return f"{value:.0f}" if abs(value) >= 100 else f"{value:.1f}"


def ratios(values):
    """The ratio of each value to the one before it."""
    pairs = zip(values, values[1:])
    return ", ".join("–" if not a or b is None else f"{b / a:.2f}" for a, b in pairs)


def line(label, values, texts=None):
    texts = texts or [number(value) for value in values]
    return "| " + " | ".join([label, *texts, ratios(values)]) + " |"


def process_lines(runs, key, unit):
    for name in PROCESSES:
        values = [of_processes(run, key)[name] for run in runs]
        if any(values):
            yield line(f"{name}, {unit}", values)


def fused_after(run):
    return " ".join("never" if n < 0 else str(n) for n in of_agents(run, "fused_after")) or "–"


def wrong(run):
    """All constraints of the agents' keyframes: number of wrong ones, of those accepted."""
    return f"{sum(of_agents(run, 'wrong'))} of {sum(of_agents(run, 'accepted'))}"


def worst_ate_mm(run):
    """None if a hall has no error: no pose of its agent is known."""
    metres = of_agents(run, "joint_ate_m")
    return 1e3 * max(metres) if metres and min(metres) >= 0 else None


def table(runs):
    names = [f"{run['keyframes']}, {run['halls']}" for run in runs]
    lines = ["| " + " | ".join(["keyframes, halls", *names, "each, of the one before"]) + " |", "|" + "---|" * (len(runs) + 2)]
    lines += process_lines(runs, "ms_a_keyframe", "CPU ms a new keyframe")
    lines += process_lines(runs, "kept_kb_a_keyframe", "kB kept of one")
    lines.append(line("longest solve, CPU ms", [run["longest_solve_ms"] for run in runs]))
    lines.append(line("keyframes until an agent is fused", [], [fused_after(run) for run in runs]))
    lines.append(line("wrong constraints", [], [wrong(run) for run in runs]))
    lines.append(line("joint ATE, mm, worst hall", [worst_ate_mm(run) for run in runs]))
    for number_of_start in range(min(len(run["starts"]) for run in runs)):
        ready = [ready_s(run["starts"][number_of_start]) for run in runs]
        cpu = [sum(process["cpu_s"] for process in run["starts"][number_of_start].values()) for run in runs]
        lines.append(line(f"start {number_of_start + 1}: s until ready", ready))
        lines.append(line(f"start {number_of_start + 1}: CPU s", cpu))
    return "\n".join(lines) + "\n"
