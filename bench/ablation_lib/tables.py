"""The results of the rungs: a table per scene, and one picture."""

import statistics
import subprocess
from dataclasses import dataclass

from ablation_lib.plan import RPE_DISTANCE_M
from ablation_lib.rungs import ALONE, LADDER, RECORDED
from accuracy_lib.anchors import MIN_COVERAGE
from accuracy_lib.metrics import read_json

COLOURS = ("#0072b2", "#d55e00", "#009e73")


@dataclass
class Metrics:
    """Metrics of one run; None for a missing one."""

    ate_m: float
    median_m: float  # of the same errors; it is not affected by the first seconds, in which a start settles
    rpe_m: float
    rpe_deg: float
    counts: bool  # one map over the whole recording


def metrics_of(job):
    ate, rpe = read_json(job.folder / "ate.json"), read_json(job.folder / "rpe.json")
    if not ate or not rpe or not job.ended_well:
        return None
    own = ate["SE(3)"]["trajectories"][0]
    row = rpe["over_distance"][0]
    if not row["position_m"]:  # lost before the end of the first part
        return None
    coverage = own["coverage"] or 0
    one_map = len(list(job.folder.glob("vio.tum*"))) == 1
    return Metrics(own["ate_m"]["rmse"], own["ate_m"]["median"], row["position_m"]["rmse"], row["rotation_deg"]["rmse"],
                   coverage >= MIN_COVERAGE and one_map)


def _spread(values, scale, digits):
    values = sorted(scale * value for value in values)
    text = f"{statistics.median(values):.{digits}f}"
    return text if len(values) == 1 else f"{text} ({values[0]:.{digits}f}–{values[-1]:.{digits}f})"


class Tables:
    def __init__(self, plan):
        self.plan = plan
        self.metrics = {key: [metrics_of(job) for job in runs.values()] for key, runs in plan.runs.items()}

    def text(self):
        scenes = self.plan.scenes()
        lines = [f"ATE, and RPE over {RPE_DISTANCE_M} m of path; median over seeds "
                 f"{', '.join(map(str, self.plan.options.seeds))} (smallest–largest); \\*: lost, or less than "
                 f"{MIN_COVERAGE:.0%} of the recording.", ""]
        names = [scene.name for scene in scenes]
        lines += ["| given | " + " | ".join(f"{n} ATE: rmse, median mm | {n} RPE mm, deg" for n in names) + " |",
                  "|---|" + "---|---|" * len(names)]
        for title, rungs in (("", LADDER), ("", [RECORDED]), ("all exact but ", ALONE)):
            for rung in rungs:
                cells = [cell for scene in scenes for cell in self._cells(scene.name, rung)]
                lines.append(f"| {title}{rung.title} | " + " | ".join(cells) + " |")
        return "\n".join(lines) + "\n"

    def _cells(self, scene, rung):
        runs = self.metrics.get((scene, rung.name))
        if runs is None:
            return "", ""
        known = [run for run in runs if run]
        if not known:
            return "–", "–"
        mark = "" if len(known) == len(runs) and all(run.counts for run in known) else "\\*"
        return (_spread([run.ate_m for run in known], 1e3, 1) + mark + ", " + _spread([run.median_m for run in known], 1e3, 1),
                _spread([run.rpe_m for run in known], 1e3, 1) + ", " + _spread([run.rpe_deg for run in known], 1, 3))

    def json(self):
        return {f"{scene} {rung}": [vars(run) if run else None for run in runs]
                for (scene, rung), runs in self.metrics.items()}

    def picture(self, path):
        """ATE down the ladder, with a line per scene and the seeds' spread as bars; drawn by gnuplot."""
        rungs = LADDER + [RECORDED]
        script = ["set terminal pngcairo noenhanced size 1400,800 font 'sans,14' background '#ffffff'", f"set output '{path}'",
                  "set ylabel 'ATE, mm'", "set logscale y", "set yrange [*:*]", "set grid ytics linecolor '#dddddd'",
                  "set rmargin 4", "set border 3 linecolor '#555555'", "set tics nomirror", "set key tmargin center horizontal",
                  f"set xrange [-0.5:{len(rungs) - 0.5}]", "set xtics rotate by 30 right",
                  "set xtics (" + ", ".join(f"'{rung.title}' {i}" for i, rung in enumerate(rungs)) + ")"]
        plots = []
        for number, scene in enumerate(self.plan.scenes()):
            rows = []
            for i, rung in enumerate(rungs):
                values = [1e3 * run.ate_m for run in self.metrics.get((scene.name, rung.name), []) if run]
                if values:
                    # The last rung is not on the ladder, so no line leads to it.
                    gap = [""] if rung is RECORDED else []
                    rows += gap + [f"{i + 0.08 * (number - 1):.2f} {statistics.median(values)} {min(values)} {max(values)}"]
            if not rows:
                continue
            script += [f"$s{number} << EOD", *rows, "EOD"]
            colour = f"linecolor '{COLOURS[number % len(COLOURS)]}' linewidth 2"
            plots += [f"$s{number} using 1:2 with lines {colour} title '{scene.name}'",
                      f"$s{number} using 1:2:3:4 with yerrorbars pointtype 7 {colour} notitle"]
        if plots:
            script.append("plot " + ", ".join(plots))
            subprocess.run(["gnuplot"], input="\n".join(script) + "\n", text=True, check=True)
