"""The jobs for the tables: render each recording, run VIO once per recording and half, run the server on the stored keyframes.

An agent's id depends on its sequence (MH_03: 3) and its half (A: 1, B: 2), so that one log serves every pair and both orders:
a replay takes the first map in its list of logs as the oldest one, which defines the group's frame.
"""

import json
import re
import time
from dataclasses import dataclass
from pathlib import Path

from accuracy_lib import anchors
from accuracy_lib.jobs import OUT, Command, Job, Runner

MAP_UTIME = "1000000"  # maps are distinguished by their agents
REPOSITORY = Path(__file__).resolve().parents[2]


class RenderJob(Job):
    """The recording is kept while it has its images, or while no other job needs them."""

    def __init__(self, *args, **kwargs):
        super().__init__(*args, **kwargs)
        self.users = []
        self.redo = ()

    def images(self):
        return (self.folder / "mav0/cam0/data").glob("*.png")

    def fresh(self):
        if not self.record() and self._complete():  # it was rendered by hand
            (self.folder / "job.json").write_text(json.dumps({"key": self.key()}) + "\n")
        if self.record().get("key") != self.key():
            return False
        return any(self.images()) or all(u.kind not in self.redo and u.fresh() for u in self.users)

    def _complete(self):
        camera = self.folder / "mav0/cam0"
        try:
            rows = [row for row in (camera / "data.csv").read_text().splitlines() if row and row[0] != "#"]
            files = [(camera / "data" / row.split(",")[1].strip()).stat() for row in rows]
        except (OSError, IndexError):
            return False
        quiet_s = 10  # no process is writing it any more
        return all(f.st_size > 0 for f in files) and max(f.st_mtime for f in files) < time.time() - quiet_s

    def drop_images(self):
        for image in self.images():
            image.unlink()


@dataclass
class Agent:
    """One VIO run: the input of a server run, and the reference for its metrics."""

    id: int
    name: str
    recording: Path
    vio: Job


class Plan:
    def __init__(self, options):
        self.options = options
        self.bin = Path(options.bin).resolve()
        self.work = Path(options.work).resolve()
        if options.seconds:
            self.work = self.work / f"{options.seconds:g}s"
        self.jobs = []
        self.agents = {}  # (set, name): Agent
        self.servers = {}  # (set, name): (Job, [Agent])
        wanted = set(options.only)
        everything = "all" in wanted
        self.tables = {t for t in ("table2", "table3", "table4", "together", "recorded_imu") if everything or t in wanted}
        if not options.groundtruth:
            self.tables = set()

    def make(self):
        for seed in self.options.seeds:
            self._rendered(seed)
        if "recorded_imu" in self.tables and self.options.imu:
            for seed in self.options.seeds:
                self._recorded_imu(seed)
        for folder in self.options.real:
            self._real(Path(folder).resolve())
        return self.jobs

    def pairs(self):
        return [pair for pair in anchors.PAPER_PAIRS if self._has(pair)]

    def together(self, groups):
        return [group for group in groups if self._has(group)]

    def sequences(self):
        return [s for s in anchors.SEQUENCES if s in self.options.sequences]

    def recorded_imu_sequences(self):
        return [s for s in anchors.RECORDED_IMU_SEQUENCES if s in self.options.sequences]

    def _has(self, sequences):
        return all(s in self.options.sequences for s in sequences)

    def _rendered(self, seed):
        where = f"seed{seed}"
        halves = "table3" in self.tables
        for sequence in self.sequences() if self.tables - {"recorded_imu"} else []:
            render = self._render(where, sequence, seed, [])
            full = self._vio(where, sequence, int(sequence[-1]), render, render.folder)
            if halves:
                split = self._split(sequence)
                a = self._vio(where, sequence + "_A", 1, render, render.folder, 0, split)
                b = self._vio(where, sequence + "_B", 2, render, render.folder, split, 0)
                self._server(where, sequence + "_AB", [a, b])
                self._server(where, sequence + "_BA", [b, a])
            self._server(where, sequence, [full])
        if "table4" in self.tables:
            for pair in self.pairs():
                self._server(where, "+".join(pair), [self.agents[where, s] for s in pair])
        if "together" in self.tables:
            for group in self.together(anchors.TOGETHER):
                self._server(where, "+".join(group), [self.agents[where, s] for s in group])

    def _recorded_imu(self, seed):
        where = f"recorded_imu_seed{seed}"
        folder = Path(self.options.imu).resolve()
        for sequence in self.recorded_imu_sequences():
            imu, stamps = only(folder, f"{sequence}*.csv"), only(folder, f"{sequence}*stamps*.txt")
            render = self._render(where, sequence, seed, ["--imu", str(imu), "--stamps", str(stamps)])
            self._server(where, sequence, [self._vio(where, sequence, int(sequence[-1]), render, render.folder)])
        for group in self.together(anchors.RECORDED_IMU_TOGETHER):
            self._server(where, "+".join(group), [self.agents[where, s] for s in group])

    def _real(self, folder):
        name = folder.parent.name if folder.name == "mav0" else folder.name
        agent = self._vio("real", name, 1, None, folder)
        self._server("real", name, [agent])

    def _split(self, sequence):
        """The time, s, at which the recording is cut, as in the sessions of Table III."""
        if self.options.seconds:
            return self.options.seconds / 2
        text = (REPOSITORY / f"sessions/table3_{sequence}_AB.yaml").read_text()
        return float(re.search(r"duration: *([0-9.]+)", text).group(1))

    def _render(self, where, sequence, seed, extra):
        folder = Path(self.options.groundtruth).resolve()
        paths = [str(only(folder, f"{s}*.csv")) for s in anchors.SEQUENCES]
        path = paths[anchors.SEQUENCES.index(sequence)]
        argv = [str(self.bin / "pangea-sim"), "--path", path, "--keep-clear", *paths, "--out", OUT, "--seed", str(seed)]
        argv += anchors.DARK_OPTIONS if sequence in anchors.DARK else []
        argv += ["--duration", f"{self.options.seconds:g}"] if self.options.seconds else []
        outside = paths + [word for word in extra if not word.startswith("--")]
        recording = self.work / "recordings" / where / sequence
        job = RenderJob("render", f"{where} {sequence}", recording, [Command(argv + extra)], outside=outside, alone=True)
        self.jobs.append(job)
        return job

    def _vio(self, where, name, agent, render, recording, start=0, duration=0):
        argv = [str(self.bin / "pangea-vio"), "--agent", str(agent), "--bus", "none", "--recording", str(recording)]
        argv += ["--rate", "max", "--map-utime", MAP_UTIME]
        argv += ["--out-tum", f"{OUT}/vio.tum", "--out-keyframes", f"{OUT}/keyframes.lcm"]
        argv += ["--start", f"{start:g}"] if start else []
        argv += ["--duration", f"{duration:g}"] if duration else []
        evaluate = self._eval("ate", [f"{OUT}/vio.tum", str(recording)])
        # Read by the replay of these keyframes: the recording, and the part of it.
        run = {"id": agent, "recording": str(recording), "start": start, "duration": duration}
        job = Job("vio", f"{where} {name}", self.work / "vio" / where / name, [Command(argv), evaluate],
                  needs=[render] if render else [], main_product="keyframes.lcm",
                  files={"recordings.json": json.dumps({"agents": [run]}) + "\n"},
                  outside=[] if render else [mav0_of(recording) / "cam0/data.csv"])
        if render:
            render.users.append(job)
        self.jobs.append(job)
        self.agents[where, name] = Agent(agent, name, recording, job)
        return self.agents[where, name]

    def _server(self, where, name, agents):
        logs = [str(agent.vio.folder / "keyframes.lcm") for agent in agents]
        argv = [str(self.bin / "pangea-session"), "replay", *logs, "--out", OUT]
        files = [word for a in agents for word in (f"{OUT}/agent_{a.id}.tum", str(a.recording))]
        evaluate = self._eval("joint" if len(agents) > 1 else "ate", files)
        job = Job("server", f"{where} {name}", self.work / "server" / where / name, [Command(argv), evaluate],
                  needs=[agent.vio for agent in agents], main_product="report.json")
        self.jobs.append(job)
        self.servers[where, name] = (job, agents)

    def _eval(self, command, files):
        argv = [str(self.bin / "pangea-eval"), command, *files, "--json", f"{OUT}/ate.json"]
        return Command(argv, optional=True)  # without ground truth, or with too few poses, there is no value


def run(jobs, options, logs):
    """Makes the missing products, and drops images after their last use if requested; with --tables-only it only checks what exists."""
    if options.tables_only:
        for job in jobs:
            job.state = "kept" if job.kind == "render" or job.record() else "missing"
        return
    renders = [job for job in jobs if job.kind == "render"]
    for render in renders:
        render.redo = options.redo

    def after(job):
        for render in renders if options.drop_images else []:
            if job in render.users and all(user.ended_well for user in render.users):
                render.drop_images()

    Runner(jobs, max(1, options.jobs), logs, options.redo, after).run()


def mav0_of(recording):
    return recording if recording.name == "mav0" else recording / "mav0"


def only(folder, pattern):
    found = sorted(folder.glob(pattern))
    if len(found) != 1:
        raise SystemExit(f"accuracy: {folder}/{pattern}: {len(found)} files, where one is needed")
    return found[0]
