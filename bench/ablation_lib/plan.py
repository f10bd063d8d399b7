"""The jobs of the ladder: render the images of each scene, compose the recording of each rung, run VIO on it."""

import sys
from dataclasses import dataclass
from pathlib import Path

from ablation_lib.rungs import ALONE, LADDER, RECORDED
from accuracy_lib import anchors
from accuracy_lib.jobs import OUT, Command, Job
from accuracy_lib.plan import MAP_UTIME, RenderJob, only

ASSEMBLE = Path(__file__).with_name("recording.py")
RPE_DISTANCE_M = 5


@dataclass(frozen=True)
class Scene:
    name: str
    seconds: float  # length, from the beginning
    sequence: str | None  # the EuRoC flight that it follows; None: a generated walk


# MH_01 is stationary on the floor from 10 to 40 s, so a longer part is used.
SCENES = [Scene("MH_01", 75, "MH_01"), Scene("MH_03", 45, "MH_03"), Scene("walk", 45, None)]


class Plan:
    def __init__(self, options):
        self.options = options
        self.bin = Path(options.bin).resolve()
        self.work = Path(options.work).resolve()
        self.jobs = []
        self.runs = {}  # (scene's name, rung's name): {seed: Job}

    def scenes(self):
        return [scene for scene in SCENES if scene.name in self.options.scenes]

    def rungs(self, scene):
        recorded = [RECORDED] if scene.sequence and self.options.imu else []
        return LADDER + recorded + ALONE

    def make(self):
        for scene in self.scenes():
            exact = self._render(scene, "perfect", 1, ["--perfect", "--tracks"])
            for rung in self.rungs(scene):
                # Without random draws one seed is enough.
                seeds = self.options.seeds if rung.given.seeded else self.options.seeds[:1]
                runs = {seed: self._run(scene, rung, seed, exact) for seed in seeds}
                self.runs[scene.name, rung.name] = runs
        return self.jobs

    def _run(self, scene, rung, seed, exact):
        if rung.given.imu_recorded:
            render = self._render(scene, "recorded", seed, self._recorded_imu(scene))
            return self._vio(scene, rung, seed, render.folder, [render], [render], None)
        images = {"perfect": lambda: exact,
                  "noisy": lambda: self._render(scene, "noisy", seed, ["--exposure-ms", "0"]),
                  "full": lambda: self._render(scene, "full", seed, [])}[rung.given.images]()
        argv = [sys.executable, str(ASSEMBLE), "--exact", str(exact.folder), "--images", str(images.folder), "--out", OUT]
        argv += ["--noise"] if rung.given.imu_noise else []
        argv += ["--bias"] if rung.given.imu_bias else []
        argv += ["--calibration", *rung.given.calibration] if rung.given.calibration else []
        argv += ["--seed", str(seed)]
        name = f"{scene.name} {rung.name} {seed}"
        folder = self.work / "recordings" / scene.name / f"{rung.name}_{seed}"
        renders = [exact] if images is exact else [exact, images]
        recording = Job("recording", name, folder, [Command(argv)], needs=renders, outside=[ASSEMBLE])
        self.jobs.append(recording)
        tracks = exact.folder / "mav0/cam0/tracks.csv" if rung.given.tracks == "exact" else None
        return self._vio(scene, rung, seed, folder, [recording], renders, tracks)

    def _vio(self, scene, rung, seed, recording, needs, renders, tracks):
        argv = [str(self.bin / "pangea-vio"), "--agent", "1", "--bus", "none", "--recording", str(recording)]
        argv += ["--rate", "max", "--map-utime", MAP_UTIME, "--out-tum", f"{OUT}/vio.tum"]
        argv += ["--tracks", str(tracks)] if tracks else []
        files = [f"{OUT}/vio.tum", str(recording)]
        evaluate = [str(self.bin / "pangea-eval")]
        commands = [Command(argv), Command([*evaluate, "ate", *files, "--json", f"{OUT}/ate.json"], optional=True),
                    Command([*evaluate, "rpe", *files, "--distances", str(RPE_DISTANCE_M), "--durations", "1", "--json",
                             f"{OUT}/rpe.json"], optional=True)]
        folder = self.work / "vio" / scene.name / f"{rung.name}_{seed}"
        job = Job("vio", f"{scene.name} {rung.name} {seed}", folder, commands, needs=needs, main_product="vio.tum")
        for render in renders:
            render.users.append(job)
        self.jobs.append(job)
        return job

    def _render(self, scene, what, seed, extra):
        folder = self.work / "rendered" / scene.name / f"{what}_{seed}"
        for job in self.jobs:
            if job.folder == folder:
                return job
        argv = [str(self.bin / "pangea-sim"), *self._path(scene), "--duration", f"{scene.seconds:g}", "--out", OUT]
        argv += ["--seed", str(seed), "--threads", str(self.options.threads), *extra]
        outside = [word for word in argv if word.endswith((".csv", ".txt"))]
        job = RenderJob("render", f"{scene.name} {what} {seed}", folder, [Command(argv)], outside=outside)
        self.jobs.append(job)
        return job

    def _path(self, scene):
        if not scene.sequence:
            return ["--generate", "walk"]
        # The hall is that of bench/accuracy, so that the frames of both are shared.
        paths = {s: str(only(Path(self.options.groundtruth).resolve(), f"{s}*.csv")) for s in anchors.SEQUENCES}
        return ["--path", paths[scene.sequence], "--keep-clear", *paths.values()]

    def _recorded_imu(self, scene):
        folder = Path(self.options.imu).resolve()
        return ["--imu", str(only(folder, f"{scene.sequence}*.csv")),
                "--stamps", str(only(folder, f"{scene.sequence}*stamps*.txt"))]
