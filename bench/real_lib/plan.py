"""The jobs for the table: a reference, VIO from each start, the server on each, and on the recording's two halves."""

import sys
from dataclasses import dataclass, field
from pathlib import Path

from accuracy_lib import plan as accuracy
from accuracy_lib.jobs import OUT, Command, Job

HERE = Path(__file__).resolve().parent
REFERENCE = "reference.colmap.tum"
MOST_IMAGES = 140


@dataclass(eq=False)
class Made(Job):
    """A job whose product replaces a rendered recording in accuracy_lib's plan; the product is always kept."""

    users: list = field(default_factory=list)


class Plan(accuracy.Plan):
    """Starts and halves as accuracy_lib's plan has recordings; `where` is always WHERE."""

    WHERE = "real"

    def __init__(self, options):
        super().__init__(options)
        self.source = Path(options.recording).resolve()
        self.recording = self.source
        self.reference_job = None
        self.covisible_job = None

    @staticmethod
    def start_name(start):
        return f"from_{start:g}s"

    def make(self):
        copy = self._changed_copy()
        self._reference()
        if self.options.funnel:
            self._covisible()
        for start in self.options.starts:
            self._server(self.WHERE, self.start_name(start), [self._run(self.start_name(start), 1, copy, start)])
        if self.options.halves:
            cut = seconds(self.source) / 2
            a, b = self._run("first_half", 1, copy, 0, cut), self._run("second_half", 2, copy, cut)
            self._server(self.WHERE, "halves_AB", [a, b])
            self._server(self.WHERE, "halves_BA", [b, a])
        return self.jobs

    def mav0(self):
        return accuracy.mav0_of(self.source)

    def _run(self, name, agent, copy, start, duration=0):
        return self._vio(self.WHERE, name, agent, copy, self.recording, start, duration)

    def _changed_copy(self):
        files, values = self.options.sensor_yaml, self.options.set
        if not files and not values:
            return None
        script, out = HERE / "linked_copy.py", self.work / "recording"
        argv = [sys.executable, str(script), str(self.source), "--out", OUT]
        argv += ["--sensor-yaml", *files] if files else []
        argv += ["--set", *values] if values else []
        outside = [script, *files, *(self.mav0() / sensor / "sensor.yaml" for sensor in ("cam0", "imu0"))]
        self.recording = out
        return self._added(Made("recording", self.source.name, out, [Command(argv)], outside=outside))

    def _reference(self):
        if self.groundtruth() or self.reference_file():
            return
        script = HERE / "colmap.py"
        argv = [sys.executable, str(script), str(self.source), "--out", OUT, "--every", str(self.options.every)]
        self.reference_job = self._added(Job("reference", self.source.name, self.work / "reference", [Command(argv)],
                                             outside=[script, self.mav0() / "cam0/data.csv"], alone=True))

    def _covisible(self):
        """All pairs of at most MOST_IMAGES images: the time grows with the square of their number."""
        script = HERE / "colmap.py"
        every = -(-len(stamps(self.mav0())) // MOST_IMAGES)
        argv = [sys.executable, str(script), str(self.source), "--out", OUT, "--every", str(every), "--exhaustive"]
        self.covisible_job = self._added(Job("covisible", self.source.name, self.work / "covisible", [Command(argv)],
                                             outside=[script, self.mav0() / "cam0/data.csv"], alone=True))

    def _added(self, job):
        self.jobs.append(job)
        return job

    def groundtruth(self):
        """The file of ground truth; a --reference takes precedence over it."""
        file = self.mav0() / "state_groundtruth_estimate0/data.csv"
        return file if file.is_file() and not self.options.reference else None

    def reference_file(self):
        """The file of camera poses, given or beside the recording."""
        beside = [self.mav0() / REFERENCE, self.mav0().parent / REFERENCE]
        given = [Path(self.options.reference)] if self.options.reference else beside
        found = next((file for file in given if file.is_file()), None)
        if self.options.reference and not found:
            raise SystemExit(f"real: {self.options.reference}: no such file")
        return found or (self.reference_job and self.reference_job.folder / REFERENCE)


def stamps(mav0):
    """The images' stamps in nanoseconds."""
    return [int(line.split(",")[0]) for line in (mav0 / "cam0/data.csv").read_text().splitlines() if line and line[0].isdigit()]


def begin(mav0):
    return min(stamps(mav0)) / 1e9


def seconds(recording):
    found = stamps(accuracy.mav0_of(recording))
    return (max(found) - min(found)) / 1e9
