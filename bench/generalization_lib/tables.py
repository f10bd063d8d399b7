"""The results: a row for each world and for each pair."""

import math

from accuracy_lib import anchors
from accuracy_lib.metrics import Measured, read_json


def metres(sample):
    return "–" if sample.value is None else f"{sample.value:.3f}"


class Tables:
    def __init__(self, plan):
        self.plan = plan
        self.measured = Measured(plan)

    def text(self):
        return "\n".join(["| recording | | path m | maps | coverage | ATE m | Sim(3) | of the path |", "|---|---|---|---|---|---|---|---|",
                          *(self._world(world) for world in self.plan.worlds()), "",
                          "| pair | fused | joint ATE m | each alone, VIO | each fused | constraints accepted, wrong |",
                          "|---|---|---|---|---|---|", *(self._pair(pair) for pair in self.plan.pairs())]) + "\n"

    def _world(self, world):
        folder = self.plan.agents[self.plan.WHERE, world.name].vio.folder
        ate = read_json(folder / "ate.json")
        maps = len(list(folder.glob("vio.tum*")))
        if not ate:
            return f"| {world.name} | {world.title} | – | {maps} | – | – | – | – |"
        path, own = self._path_m(world), ate["SE(3)"]["trajectories"][0]
        rmse, scaled = own["ate_m"]["rmse"], ate["Sim(3)"]["ate_m"]["rmse"]
        mark = "" if maps == 1 and own["coverage"] >= anchors.MIN_COVERAGE else "\\*"
        return (f"| {world.name} | {world.title} | {path:.0f} | {maps} | {own['coverage']:.2f}{mark} | {rmse:.3f} | {scaled:.3f} | "
                f"{rmse / path:.2%} |")

    def _path_m(self, world):
        """Length of the ground-truth path, metres."""
        recording = self.plan.agents[self.plan.WHERE, world.name].recording
        rows = (recording / "mav0/state_groundtruth_estimate0/data.csv").read_text().splitlines()
        points = [[float(x) for x in row.split(",")[1:4]] for row in rows if row and row[0] != "#"][::10]
        return sum(math.dist(p, q) for p, q in zip(points, points[1:]))

    def _pair(self, pair):
        where, name = self.plan.WHERE, "+".join(pair)
        report = self.measured.report(where, name)
        if not report:
            return f"| {name} | no value | | | | |"
        agents = [self.plan.agents[where, one].id for one in pair]
        alone = ", ".join(metres(self.measured.part(where, name, agent)) for agent in agents)
        fused = ", ".join(metres(self.measured.server(where, name, agent)) for agent in agents)
        truth = report["constraints_truth"]["inter"] or {"checked": 0, "wrong": 0}
        joined = "yes" if self.measured.fused(where, name) else "no"
        return (f"| {name} | {joined} | {metres(self.measured.joint(where, name))} | {alone} | {fused} | "
                f"{truth['checked']}, {truth['wrong']} |")
