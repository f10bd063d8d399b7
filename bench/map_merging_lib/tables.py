"""The results: a row for each session, and the bounds that it misses."""

from dataclasses import dataclass, field

from accuracy_lib.metrics import Measured
from map_merging_lib.worlds import MUST, NEVER

WORSE_M, ORDER_M = 0.005, 0.005
NEES, FEW_CONSTRAINTS = (0.5, 2.0), 10  # a mean of fewer is not significant


def metres(value):
    return "–" if value is None else f"{value:.3f}"


@dataclass
class Row:
    session: object
    alone: list = field(default_factory=list)  # metres, for each recording with the server alone
    fused: list = field(default_factory=list)  # the same in the session
    joint: list = field(default_factory=list)  # of the joint map, for both orders
    apart: bool = True
    constraints: int = 0  # accepted between the recordings, in the order with more of them
    wrong: int = 0  # of these and of the loops within maps, in the worse order
    nees: float | None = None  # per dimension, of `constraints`
    vio: list = field(default_factory=list)  # faults of the odometry alone

    def missed(self):
        out = list(self.vio)
        if self.session.fuse == NEVER:
            return out + ([f"{self.constraints} constraints"] if self.constraints else [])
        if self.session.fuse == MUST and self.apart:
            out.append("apart")
        if self.wrong:
            out.append(f"{self.wrong} wrong")
        if self.nees is not None and self.constraints >= FEW_CONSTRAINTS and not NEES[0] <= self.nees <= NEES[1]:
            out.append("NEES")
        if any(b is not None and a is not None and b > a + WORSE_M for a, b in zip(self.alone, self.fused)):
            out.append("worse than alone")
        if None in self.joint and any(x is not None for x in self.joint):
            out.append("order decides")
        elif None not in self.joint and abs(self.joint[0] - self.joint[1]) > ORDER_M:
            out.append("order")
        return out

    def text(self):
        session = self.session
        constraints = f"{self.constraints}, {self.constraints if session.fuse == NEVER else self.wrong}"
        nees = "–" if self.nees is None or session.fuse == NEVER else f"{self.nees:.2f}"
        return (f"| {session.name} | {session.title} | {session.fuse} | {'no' if self.apart else 'yes'} | "
                f"{' / '.join(map(metres, self.joint))} | {', '.join(map(metres, self.alone))} | "
                f"{', '.join(map(metres, self.fused))} | {constraints} | {nees} | {', '.join(self.missed()) or 'none'} |")


class Tables:
    HEAD = ["| session | | should fuse | fused | joint ATE m, either order | each alone | each in it | constraints, wrong | NEES | missed |",
            "|---|---|---|---|---|---|---|---|---|---|"]

    def __init__(self, plan):
        self.plan = plan
        self.measured = Measured(plan)
        self.rows = [self._row(session) for session in plan.sessions()]

    def text(self):
        return "\n".join([*self._worlds(), "", *self.HEAD, *(row.text() for row in self.rows)]) + "\n"

    def missed(self):
        return [f"{row.session.name}: {what}" for row in self.rows for what in row.missed()]

    def _worlds(self):
        yield "| recording | | ATE m, VIO | with server | constraints, wrong | NEES | coverage |"
        yield "|---|---|---|---|---|---|---|"
        for world in self.plan.worlds():
            report = self.measured.report(self.plan.WHERE, world.name)
            if not report:
                yield f"| {world.name} | {world.title} | no value | | | | |"
                continue
            agent, constraints = report["agents"][0], report["constraints_truth"]["intra"]
            checked, wrong, nees = _constraints(constraints)
            yield (f"| {world.name} | {world.title} | {metres(agent['ate_vio_m'])} | {metres(agent['ate_server_m'])} | "
                   f"{checked}, {wrong} | {'–' if nees is None else f'{nees:.2f}'} | {agent['coverage'] or 0:.2f} |")

    def _row(self, session):
        where = self.plan.WHERE
        row = Row(session)
        reports = [self.measured.report(where, name) for name in (session.name, session.name + " back")]
        if None in reports:
            row.vio.append("no value")
            row.joint = [None, None]
            return row
        row.apart = not self.measured.fused(where, session.name)
        row.joint = [self.measured.joint(where, name).value for name in (session.name, session.name + " back")]
        truths = [report["constraints_truth"] for report in reports]
        row.constraints, _, row.nees = max((_constraints(truth["inter"]) for truth in truths), key=lambda found: found[0])
        row.wrong = max(truth["wrong"] for truth in truths)
        for name in session.names:
            agent = self.plan.agents[where, name].id
            row.alone.append(self.measured.server(where, name, agent).value)
            row.fused.append(self.measured.server(where, session.name, agent).value)
            row.vio += [f"{name}: {reason}" for reason in self.measured.server(where, name, agent).reasons]
        return row


def _constraints(truth):
    """Numbers of checked and of wrong constraints, and the mean NEES per dimension."""
    if not truth or not truth["checked"]:
        return 0, 0, None
    return truth["checked"], truth["wrong"], truth["nees_per_dim"]["mean"]
