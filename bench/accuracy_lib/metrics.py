"""Measured values: samples over seeds, whether each counts and the reason if not, and their median."""

import json
import math
import statistics
from dataclasses import dataclass, field

from accuracy_lib import anchors


def read_json(path):
    try:
        return json.loads(path.read_text())
    except (OSError, ValueError):
        return None


@dataclass
class Sample:
    value: float | None = None  # metres; None: unknown
    reasons: list = field(default_factory=list)  # reasons for which the value does not count

    @property
    def counts(self):
        return self.value is not None and not self.reasons


class Series:
    """One cell of a table: a value for each seed."""

    def __init__(self, what, samples):
        self.what = what
        self.samples = samples  # seed (or any label): Sample

    def median(self):
        """Median of all seeds; a seed that does not count is infinitely bad. None without seeds, or if too few count."""
        if not self.samples:
            return None
        median = statistics.median(s.value if s.counts else math.inf for s in self.samples.values())
        return median if math.isfinite(median) else None

    def at_most(self, bar):
        median = self.median()
        return median is not None and median <= bar

    def text(self):
        values = [s.value for s in self.samples.values() if s.value is not None]
        if not values:
            return "–"
        mark = "" if all(s.counts for s in self.samples.values()) else "*"
        median = self.median()
        shown = f"{statistics.median(values) if median is None else median:.3f}{mark}"
        return shown if len(values) == 1 else f"{shown} ({min(values):.3f}–{max(values):.3f})"

    def remarks(self):
        return [f"{self.what}, {label}: {'; '.join(s.reasons)}" for label, s in self.samples.items() if s.reasons]

    def to_json(self):
        samples = {label: {"ate_m": s.value, "reasons": s.reasons} for label, s in self.samples.items()}
        return {"median_m": self.median(), "samples": samples}


def _uncounted(agent):
    reasons = []
    coverage = agent.get("coverage")
    if coverage is None or coverage < anchors.MIN_COVERAGE:
        reasons.append("coverage unknown" if coverage is None else f"coverage {coverage:.2f}")
    if len(agent.get("map_ids", [])) != 1:
        reasons.append(f"{len(agent.get('map_ids', []))} maps")
    return reasons


class Measured:
    """Reads the products of a plan."""

    def __init__(self, plan):
        self.plan = plan

    def vio(self, where, name, alignment="SE(3)"):
        agent = self.plan.agents.get((where, name))
        ate = agent and agent.vio.ended_well and read_json(agent.vio.folder / "ate.json")
        if not ate:
            return Sample(None, ["no value"])
        own = ate[alignment]["trajectories"][0]
        maps = len(list(agent.vio.folder.glob("vio.tum*")))
        return Sample(own["ate_m"]["rmse"], _uncounted({"coverage": own["coverage"], "map_ids": range(maps)}))

    def part(self, where, name, agent_id):
        """VIO on one half, from the keyframes; the coverage is relative to the half."""
        report = self.report(where, name)
        return self._of_agent(report, agent_id, "ate_vio_m")

    def server(self, where, name, agent_id):
        return self._of_agent(self.report(where, name), agent_id, "ate_server_m")

    def server_sim3(self, where, name):
        sample = self.joint(where, name)
        ate = read_json(self.plan.servers[where, name][0].folder / "ate.json")
        return Sample(ate["Sim(3)"]["ate_m"]["rmse"] if ate and sample.value is not None else None, sample.reasons)

    def joint(self, where, name):
        """All agents of a server run with one alignment; there is a value only if they are in one map."""
        report = self.report(where, name)
        if report is None:
            return Sample(None, ["no value"])
        ids = sorted(agent.id for agent in self.plan.servers[where, name][1])
        reasons = [f"agent {a['id']}: {r}" for a in report["agents"] for r in _uncounted(a)]
        for group in report["groups"]:
            if sorted(group["agents"]) == ids:
                return Sample(group["ate_joint_m"], reasons)
        return Sample(None, ["not fused", *reasons])

    def fused(self, where, name):
        sample = self.joint(where, name)
        return "not fused" not in sample.reasons and "no value" not in sample.reasons

    def constraints(self, where, name):
        report = self.report(where, name)
        return report["constraints"]["accepted_inter"] if report else 0

    def report(self, where, name):
        job = self.plan.servers.get((where, name), [None])[0]
        return read_json(job.folder / "report.json") if job and job.ended_well else None

    def _of_agent(self, report, agent_id, key):
        for agent in report["agents"] if report else []:
            if agent["id"] == agent_id and agent[key] is not None:
                return Sample(agent[key], _uncounted(agent))
        return Sample(None, ["no value"])
