"""The tables and the checks, as Markdown and as JSON."""

from dataclasses import dataclass

from accuracy_lib import anchors
from accuracy_lib.metrics import Sample, Series


@dataclass
class Check:
    text: str
    passed: bool
    bar: bool  # a bar fails the run, a goal does not


def _metres(value):
    return "–" if value is None else f"{value:.3f}"


def _passed(passed):
    return "pass" if passed else "FAIL"


class Tables:
    def __init__(self, plan, measured):
        self.plan = plan
        self.measured = measured
        self.lines = []
        self.checks = []
        self.json = {}
        self.seeds = plan.options.seeds

    def make(self):
        makers = {"table2": self._table2, "table3": self._table3, "table4": self._table4, "together": self._together,
                  "recorded_imu": self._recorded_imu}
        for name, maker in makers.items():
            if name in self.plan.tables and (name != "recorded_imu" or self.plan.options.imu):
                maker()
        if self.plan.options.real:
            self._real()
        self._checks()
        return "\n".join(self.lines) + "\n"

    def failed_bars(self):
        return [v.text for v in self.checks if v.bar and not v.passed]

    # One value per seed.
    def _series(self, what, of_seed):
        return Series(what, {f"seed {seed}": of_seed(seed) for seed in self.seeds})

    def _vio(self, prefix, s, alignment="SE(3)"):
        return self._series(f"{s} VIO", lambda seed: self.measured.vio(f"{prefix}{seed}", s, alignment))

    def _server(self, prefix, name, s):
        return self._series(f"{name} server", lambda seed: self.measured.server(f"{prefix}{seed}", name, int(s[-1])))

    def _server_sim3(self, prefix, name):
        return self._series(f"{name} Sim(3)", lambda seed: self.measured.server_sim3(f"{prefix}{seed}", name))

    def _joint(self, prefix, name):
        return self._series(f"{name} joint", lambda seed: self.measured.joint(f"{prefix}{seed}", name))

    def _fused(self, prefix, name):
        return sum(self.measured.fused(f"{prefix}{seed}", name) for seed in self.seeds)

    def _table(self, key, title, header, rows, series):
        """`series`: row name -> {column: Series}; the remarks of the series are listed below the table."""
        self.lines += [f"## {title}", "", "| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
        self.lines += ["| " + " | ".join(row) + " |" for row in rows]
        every = [s for columns in series.values() for s in columns.values()]
        remarks = list(dict.fromkeys(r for s in every for r in s.remarks()))
        self.lines += ["", *[f"- \\* {remark}" for remark in remarks], *([""] if remarks else [])]
        self.json[key] = {row: {c: s.to_json() for c, s in columns.items()} for row, columns in series.items()}

    def _bar(self, text, passed):
        self.checks.append(Check(text, bool(passed), True))

    def _goal(self, text, passed):
        self.checks.append(Check(text, bool(passed), False))

    def _most(self, text, passes):
        """The bar: all but one of the five sequences must pass; of fewer sequences all must."""
        needed = len(passes) - (1 if len(passes) == len(anchors.SEQUENCES) else 0)
        self._bar(f"{text}: {sum(passes)} of {len(passes)}, {needed} needed", sum(passes) >= needed)

    def _table2(self):
        rows, series, vio_passes, server_passes = [], {}, [], []
        for s in self.plan.sequences():
            vio, server = self._vio("seed", s), self._server("seed", s, s)
            sim3 = {"vio_sim3": self._vio("seed", s, "Sim(3)"), "server_sim3": self._server_sim3("seed", s)}
            series[s] = {"vio": vio, "server": server, **sim3}
            vio_passes.append(vio.at_most(anchors.VIO_BAR))
            server_passes.append(server.at_most(anchors.PAPER_SERVER[s]))
            rows.append([s, vio.text(), sim3["vio_sim3"].text(), _passed(vio_passes[-1]), server.text(),
                         sim3["server_sim3"].text(), _passed(server_passes[-1]), _metres(anchors.PAPER_ALONE[s]),
                         _metres(anchors.PAPER_SERVER[s]), _metres(anchors.ORB_SLAM3_MONO_INERTIAL[s])])
            self._goal(f"{s} VIO at most {anchors.VIO_GOAL[s]} m", vio.at_most(anchors.VIO_GOAL[s]))
        self._table("table2", "Table II: one agent, ATE m",
                    ["recording", "VIO", "VIO Sim(3)", f"≤ {anchors.VIO_BAR}", "with server", "with server Sim(3)",
                     "≤ paper's best", "paper: phone alone", "paper: with server", "ORB-SLAM3 mono-inertial"],
                    rows, series)
        self._most(f"VIO alone at most {anchors.VIO_BAR} m", vio_passes)
        self._most("one agent with server no worse than the paper's best", server_passes)
        self._mean_goals("one agent with server", [series[s]["server"] for s in series], anchors.SERVER_MEAN_GOAL,
                         anchors.SERVER_WORST_GOAL)

    def _mean_goals(self, text, series, mean_goal, worst_goal=None):
        medians = [s.median() for s in series]
        known = bool(medians) and None not in medians
        mean = sum(medians) / len(medians) if known else None
        self._goal(f"{text}: mean {_metres(mean)} m, at most {mean_goal} m", known and mean <= mean_goal)
        if worst_goal:
            worst = max(medians) if known else None
            self._goal(f"{text}: largest {_metres(worst)} m, at most {worst_goal} m", known and worst <= worst_goal)

    def _table3(self):
        rows, series, passes = [], {}, []
        for s in self.plan.sequences():
            ab, ba = self._joint("seed", s + "_AB"), self._joint("seed", s + "_BA")
            halves = [self._series(f"{s}_{half} VIO", lambda seed, i=i, s=s: self.measured.part(f"seed{seed}", s + "_AB", i))
                      for i, half in ((1, "A"), (2, "B"))]
            between = self._difference(s, ab, ba)
            series[s] = {"a": halves[0], "b": halves[1], "ab": ab, "ba": ba, "difference": between}
            fused = [self._fused("seed", s + order) for order in ("_AB", "_BA")]
            passes.append(min(fused) == len(self.seeds))
            paper_ab, paper_ba, paper_one = anchors.PAPER_HALVES[s]
            rows.append([s, halves[0].text(), halves[1].text(), "{}, {} of {}".format(*fused, len(self.seeds)),
                         _passed(passes[-1]), ab.text(), ba.text(), between.text(), _metres(paper_ab),
                         _metres(paper_ba), _metres(paper_one)])
            best = min(anchors.PAPER_HALVES[s])
            self._goal(f"{s} halves: both joint maps better than the paper's best, {best} m",
                       ab.at_most(best) and ba.at_most(best))
            self._goal(f"{s} halves: the orders differ by at most {anchors.ORDER_GOAL} m",
                       between.at_most(anchors.ORDER_GOAL))
        self._table("table3", "Table III: two halves of a recording as two agents, joint ATE m",
                    ["recording", "first half, VIO", "second half, VIO", "fused A←B, B←A", "fused", "A←B joint",
                     "B←A joint", "difference", "paper: A←B", "paper: B←A", "paper: one agent"], rows, series)
        self._bar(f"halves fused in both orders, every seed: {sum(passes)} of {len(passes)} recordings", all(passes))

    def _difference(self, s, ab, ba):
        samples = {}
        for seed, first in ab.samples.items():
            second = ba.samples[seed]
            known = first.value is not None and second.value is not None
            samples[seed] = Sample(abs(first.value - second.value) if known else None, first.reasons + second.reasons)
        return Series(f"{s} difference of the orders", samples)

    def _table4(self):
        rows, series, fused_passes, ate_passes = [], {}, [], []
        for pair in self.plan.pairs():
            name, bar, paper = "+".join(pair), anchors.pair_bar(pair), anchors.PAPER_PAIRS[pair]
            joint = self._joint("seed", name)
            second, alone = self._server("seed", name, pair[1]), self._server("seed", pair[1], pair[1])
            series[name] = {"joint": joint, "joint_sim3": self._server_sim3("seed", name), "second": second, "alone": alone}
            fused = self._fused("seed", name)
            constraints = [self.measured.constraints(f"seed{seed}", name) for seed in self.seeds]
            fused_passes.append(fused == len(self.seeds))
            ate_passes.append(joint.at_most(bar))
            rows.append([name, f"{fused} of {len(self.seeds)}", "–".join(map(str, sorted({min(constraints), max(constraints)}))), joint.text(), str(bar),
                         _passed(fused_passes[-1] and ate_passes[-1]), series[name]["joint_sim3"].text(), second.text(),
                         alone.text(), *map(_metres, paper)])
            self._goal(f"{name}: second agent better than the paper's best, {min(paper)} m", second.at_most(min(paper)))
            together, by_itself = second.median(), alone.median()
            known = together is not None and by_itself is not None
            self._goal(f"{name}: second agent at most {anchors.FUSING_COSTS_GOAL} m worse than alone",
                       known and together <= by_itself + anchors.FUSING_COSTS_GOAL)
        self._table("table4", "Table IV: two agents, ATE m",
                    ["pair", "fused", "constraints accepted", "joint", "bar", "fused, joint ≤ bar", "joint Sim(3)",
                     "second agent in it", "second agent alone", "paper: second agent in it", "paper: alone",
                     "paper: VINS-Mono"], rows, series)
        self._bar(f"pairs fused, every seed: {sum(fused_passes)} of {len(fused_passes)}", all(fused_passes))
        self._bar(f"pairs' joint ATE within its bar: {sum(ate_passes)} of {len(ate_passes)}", all(ate_passes))

    def _groups(self, key, title, prefix, groups, goals):
        rows, series = [], {}
        for group in groups:
            name = "+".join(group)
            joint, sim3 = self._joint(prefix, name), self._server_sim3(prefix, name)
            series[name] = {"joint": joint, "joint_sim3": sim3}
            others = anchors.TOGETHER.get(group, (None, None, None))
            rows.append([name, f"{self._fused(prefix, name)} of {len(self.seeds)}", joint.text(), sim3.text(),
                         *map(_metres, others)])
            self._goal(f"{title}: {name} joint at most {goals[group]} m", joint.at_most(goals[group]))
        if rows:
            self._table(key, title, ["agents", "fused", "joint ATE m", "Sim(3)", "COVINS, Sim(3)",
                                     "ORB-SLAM3 mono-inertial", "ORB-SLAM3 stereo-inertial"], rows, series)

    def _together(self):
        self._groups("together", "All together", "seed", self.plan.together(anchors.TOGETHER), anchors.TOGETHER_GOAL)

    def _recorded_imu(self):
        rows, series = [], {}
        for s in self.plan.recorded_imu_sequences():
            columns = {"vio": self._vio("recorded_imu_seed", s), "rendered_vio": self._vio("seed", s),
                       "server": self._server("recorded_imu_seed", s, s), "rendered_server": self._server("seed", s, s)}
            series[s] = {c: cell for c, cell in columns.items() if c in ("vio", "server")}
            ratios = [self._ratio(columns[c], columns["rendered_" + c]) for c in ("vio", "server")]
            rows.append([s, columns["vio"].text(), columns["rendered_vio"].text(), ratios[0], columns["server"].text(),
                         columns["rendered_server"].text(), ratios[1], _metres(anchors.ORB_SLAM3_MONO_INERTIAL[s])])
        self._table("recorded_imu", "Recorded IMU, rendered images, one agent, ATE m",
                    ["recording", "VIO", "all rendered", "ratio", "with server", "all rendered", "ratio",
                     "ORB-SLAM3 mono-inertial"], rows, series)
        self._mean_goals("recorded IMU, one agent with server", [series[s]["server"] for s in series], anchors.RECORDED_IMU_MEAN_GOAL)
        self._groups("recorded_imu_together", "Recorded IMU and rendered images together", "recorded_imu_seed",
                     self.plan.together(anchors.RECORDED_IMU_TOGETHER), anchors.RECORDED_IMU_TOGETHER_GOAL)

    def _ratio(self, recorded, rendered):
        a, b = recorded.median(), rendered.median()
        if a is None or not b:
            return "–"
        factor = anchors.RECORDED_IMU_FACTOR
        return f"{a / b:.2f}" + ("" if 1 / factor <= a / b <= factor else " (!)")

    def _real(self):
        rows, series = [], {}
        for (where, name), agent in self.plan.agents.items():
            if where != "real":
                continue
            one = lambda what, sample: Series(f"{name} {what}", {"real": sample})
            columns = {"vio": one("VIO", self.measured.vio("real", name)),
                       "vio_sim3": one("VIO", self.measured.vio("real", name, "Sim(3)")),
                       "server": one("server", self.measured.server("real", name, agent.id)),
                       "server_sim3": one("server", self.measured.server_sim3("real", name))}
            series[name] = columns
            paper = [_metres(metrics.get(name[:5])) for metrics in
                     (anchors.PAPER_ALONE, anchors.PAPER_SERVER, anchors.ORB_SLAM3_MONO_INERTIAL)]
            rows.append([name, *[cell.text() for cell in columns.values()], *paper])
        self._table("real", "Real recordings: one agent, ATE m",
                    ["recording", "VIO", "VIO Sim(3)", "with server", "with server Sim(3)", "paper: phone alone",
                     "paper: with server", "ORB-SLAM3 mono-inertial"], rows, series)

    def _checks(self):
        for title, bar in (("Bars", True), ("Goals", False)):
            checks = [v for v in self.checks if v.bar == bar]
            if checks:
                self.lines += [f"## {title}", "", *[f"- {_passed(v.passed)}: {v.text}" for v in checks], ""]
        self.json["checks"] = [{"text": v.text, "passed": v.passed, "bar": v.bar} for v in self.checks]
