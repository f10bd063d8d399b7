"""What came out: a row for each meeting, and what it misses of what it is held to."""

from dataclasses import dataclass, field

from accuracy_lib.figures import Measured
from meetings_lib.worlds import MUST, NEVER

WORSE_M, ORDER_M = 0.005, 0.005
NEES, FEW_LINKS = (0.5, 2.0), 10  # the mean of fewer says nothing


def metres(value):
    return "–" if value is None else f"{value:.3f}"


@dataclass
class Row:
    meeting: object
    alone: list = field(default_factory=list)  # metres, each with the server alone
    fused: list = field(default_factory=list)  # the same in the meeting
    joint: list = field(default_factory=list)  # the joint map's, in either order
    apart: bool = True
    links: int = 0  # accepted between them
    wrong: int = 0  # of these and of loops
    nees: float | None = None  # a dimension
    vio: list = field(default_factory=list)  # what is wrong with the odometry alone

    def missed(self):
        out = list(self.vio)
        if self.meeting.fuse == NEVER:
            return out + ([f"{self.links} links"] if self.links else [])
        if self.meeting.fuse == MUST and self.apart:
            out.append("apart")
        if self.wrong:
            out.append(f"{self.wrong} wrong")
        if self.nees is not None and self.links >= FEW_LINKS and not NEES[0] <= self.nees <= NEES[1]:
            out.append("squares")
        if any(b is not None and a is not None and b > a + WORSE_M for a, b in zip(self.alone, self.fused)):
            out.append("worse than alone")
        if None in self.joint and any(x is not None for x in self.joint):
            out.append("order decides")
        elif None not in self.joint and abs(self.joint[0] - self.joint[1]) > ORDER_M:
            out.append("order")
        return out

    def text(self):
        meeting = self.meeting
        links = f"{self.links}, {self.links if meeting.fuse == NEVER else self.wrong}"
        nees = "–" if self.nees is None or meeting.fuse == NEVER else f"{self.nees:.2f}"
        return (f"| {meeting.name} | {meeting.title} | {meeting.fuse} | {'no' if self.apart else 'yes'} | "
                f"{' / '.join(map(metres, self.joint))} | {', '.join(map(metres, self.alone))} | "
                f"{', '.join(map(metres, self.fused))} | {links} | {nees} | {', '.join(self.missed()) or 'none'} |")


class Tables:
    HEAD = ["| meeting | | should fuse | fused | joint ATE m, either order | each alone | each in it | links, wrong | squares | missed |",
            "|---|---|---|---|---|---|---|---|---|---|"]

    def __init__(self, plan):
        self.plan = plan
        self.measured = Measured(plan)
        self.rows = [self._row(meeting) for meeting in plan.meetings()]

    def text(self):
        return "\n".join([*self._worlds(), "", *self.HEAD, *(row.text() for row in self.rows)]) + "\n"

    def missed(self):
        return [f"{row.meeting.name}: {what}" for row in self.rows for what in row.missed()]

    def _worlds(self):
        yield "| recording | | ATE m, VIO | with server | links, wrong | squares | coverage |"
        yield "|---|---|---|---|---|---|---|"
        for world in self.plan.worlds():
            report = self.measured.report(self.plan.WHERE, world.name)
            if not report:
                yield f"| {world.name} | {world.title} | no figure | | | | |"
                continue
            agent, links = report["agents"][0], report["constraints_truth"]["intra"]
            checked, wrong, nees = _links(links)
            yield (f"| {world.name} | {world.title} | {metres(agent['ate_vio_m'])} | {metres(agent['ate_server_m'])} | "
                   f"{checked}, {wrong} | {'–' if nees is None else f'{nees:.2f}'} | {agent['coverage'] or 0:.2f} |")

    def _row(self, meeting):
        where = self.plan.WHERE
        row = Row(meeting)
        report = self.measured.report(where, meeting.name)
        if not report or not self.measured.report(where, meeting.name + " back"):
            row.vio.append("no figure")
            row.joint = [None, None]
            return row
        row.apart = not self.measured.fused(where, meeting.name)
        row.joint = [self.measured.joint(where, name).value for name in (meeting.name, meeting.name + " back")]
        row.links, _, row.nees = _links(report["constraints_truth"]["inter"])
        row.wrong = report["constraints_truth"]["wrong"]
        for name in meeting.names:
            agent = self.plan.agents[where, name].id
            row.alone.append(self.measured.server(where, name, agent).value)
            row.fused.append(self.measured.server(where, meeting.name, agent).value)
            row.vio += [f"{name}: {reason}" for reason in self.measured.server(where, name, agent).reasons]
        return row


def _links(truth):
    """Checked, wrong, and the mean of the normalised squares a dimension."""
    if not truth or not truth["checked"]:
        return 0, 0, None
    return truth["checked"], truth["wrong"], truth["nees_per_dim"]["mean"]
