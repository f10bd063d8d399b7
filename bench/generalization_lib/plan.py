"""The recordings and the pairs of them; they are rendered, spoiled, run through VIO, and fused in pairs."""

import sys
from dataclasses import dataclass
from pathlib import Path

from accuracy_lib import plan as accuracy
from accuracy_lib.jobs import OUT, Command, Job
from generalization_lib import paths

SPOIL = Path(__file__).with_name("spoil.py")


@dataclass(frozen=True)
class World:
    """A recording: a path in a scene of its own, or another recording spoiled."""

    name: str
    title: str
    scene: tuple = ()  # hall or room, and its seed
    path: tuple = ()  # pangea-sim's generated walk or flight and seed; a path of paths.WAYS; or an EuRoC path from a given second
    seconds: float = 30
    options: tuple = ()  # further options of pangea-sim
    spoiled: tuple = ()  # the faults, from spoil.SPOILERS
    source: str = ""  # the recording to which faults are added, if it is another's


HALL, ROOM, FLIGHTS = ("hall", 101), ("room", 102), ("hall", 103)
PHONE = ("--camera", "phone", "--image-rate", "30")
WORLDS = [
    World("flight", "a drone's flight", HALL, ("flight", 31), 40),
    World("phone", "a phone on a walk: fisheye, rolling shutter, 30 Hz, its IMU at 100 Hz", HALL, ("walk", 32), 40, PHONE,
          ("phone_imu",)),
    World("small", "a walk at half the resolution", HALL, ("walk", 36), options=("--shrink", "2")),
    World("dark", "a flight in the dark: 15 ms of exposure", HALL, ("flight", 37),
          options=("--exposure-ms", "15", "--brightness", "0.2")),
    World("room", "a walk in a room", ROOM, ("walk", 33), 40),
    World("wide", "a wide fisheye in that room (TUM-VI's)", ROOM, ("walk", 39), options=("--camera", "wide")),
    World("room_phone", "the phone in that room", ROOM, ("walk", 34), 40, PHONE, ("phone_imu",)),
    World("mh02", "MH_02's path from its 60th second", FLIGHTS, ("MH_02", 60)),
    World("mh03", "MH_03's path from its 50th second", FLIGHTS, ("MH_03", 50)),
    World("v103", "V1_03's path from its 40th second", ("room", 104), ("V1_03", 40)),
    World("stands", "a walk that stands for 8 and for 14 s", ("room", 105), ("stands",), 46),
    World("turns", "somebody turns twice on the spot", ("hall", 106), ("turns",), 34),
    World("drives", "5 m/s straight ahead", ("hall", 107), ("drives",), 20),
    World("half_rate", "10 images per second", source="flight", spoiled=("half_rate",)),
    World("image_gaps", "0.3 s without images every 5 s", source="flight", spoiled=("image_gaps",)),
    World("lone_images", "every tenth image missing", source="flight", spoiled=("lone_images",)),
    World("imu_gaps", "50 ms without IMU every 3 s", source="flight", spoiled=("imu_gaps",)),
    World("covered", "a hand over the lens for 1 s and for 2 s", source="flight", spoiled=("covered",)),
    World("hand", "a hand over the lens for 3 s and for 4.5 s", source="flight", spoiled=("hand",)),
    World("people", "people walk past, while it stands and while it walks", source="stands", spoiled=("people",)),
    World("crowd", "a crowd fills the view, while it stands and while it walks", source="stands", spoiled=("crowd",)),
    World("pocket", "the phone in a pocket for 8 s", source="phone", spoiled=("phone_imu", "pocket")),
    World("exposure_steps", "exposure jumps to 0.4, to 1.8 and back, every 3 s", source="flight", spoiled=("exposure_steps",)),
    World("disorder", "rows out of order and twice", source="flight", spoiled=("disorder",)),
    World("focal_length", "focal length 0.5 % too long", source="flight", spoiled=("focal_length",)),
    World("extrinsics", "extrinsics off by 0.5 degrees", source="flight", spoiled=("extrinsics",)),
    World("late_images", "clocks 40 ms apart", source="flight", spoiled=("late_images",)),
    World("jitter", "images stamped to 2 ms", source="flight", spoiled=("jitter",)),
    World("copies_at_60_hz", "each image again at 60 Hz", source="flight", spoiled=("copies_at_60_hz",)),
    World("repeated_images", "one in five images repeats the one before", source="flight", spoiled=("repeated_images",)),
    World("shown_too_early", "every other image shows the one after it", source="flight", spoiled=("shown_too_early",)),
    World("accel_bias", "accelerometer off by 0.3 m/s^2", source="flight", spoiled=("accel_bias",)),
]
PAIRS = [("flight", "phone"), ("flight", "dark"), ("small", "phone"), ("room", "wide"), ("room_phone", "wide"), ("mh02", "mh03"),
         ("focal_length", "phone")]


class Plan(accuracy.Plan):
    """Worlds and pairs as accuracy_lib's plan has recordings and pairs; `where` is always WHERE."""

    WHERE = "worlds"

    def __init__(self, options):
        super().__init__(options)
        self.renders = {}

    def worlds(self):
        return [world for world in WORLDS if not self.options.worlds or world.name in self.options.worlds]

    def pairs(self):
        chosen = {world.name for world in self.worlds()}
        return [pair for pair in PAIRS if chosen.issuperset(pair)]

    def make(self):
        for world in self.worlds():
            agent = 1 + WORLDS.index(world)
            recording = self._recording(world)
            self._vio(self.WHERE, world.name, agent, recording, recording.folder)
        for pair in self.pairs():
            self._server(self.WHERE, "+".join(pair), [self.agents[self.WHERE, name] for name in pair])
        return self.jobs

    def _recording(self, world):
        source = next(w for w in WORLDS if w.name == world.source) if world.source else world
        render = self.renders.get(source.name) or self._rendering(source)
        return Spoiling.added(self, world.name, render, world.spoiled) if world.spoiled else render

    def _rendering(self, world):
        kind, seed = world.scene
        argv = [str(self.bin / "pangea-sim"), "--scene", kind, "--scene-seed", str(seed), *self._path(world)]
        argv += ["--duration", f"{world.seconds:g}", *world.options, "--out", OUT, "--seed", str(seed), "--threads", "1", "--no-cache"]
        outside = [word for word in argv if word.endswith(".csv")]
        folder = self.work / "rendered" / world.name
        job = accuracy.RenderJob("render", world.name, folder, [Command(argv)], outside=outside)
        if world.path[0] in paths.WAYS:
            job.files = {"path.tum": paths.tum(paths.WAYS[world.path[0]], world.seconds + 1)}
        self.jobs.append(job)
        self.renders[world.name] = job
        return job

    def _path(self, world):
        what, *more = world.path
        if what in paths.WAYS:
            return ["--path", f"{OUT}/path.tum"]
        if what in ("walk", "flight"):
            return ["--generate", what, "--path-seed", str(more[0])]
        files = {name: self._groundtruth(name) for name in {w.path[0] for w in WORLDS if w.scene == world.scene}}
        return ["--path", files[what], "--keep-clear", *sorted(files.values()), "--start", str(more[0])]

    def _groundtruth(self, sequence):
        return str(accuracy.only(Path(self.options.groundtruth).resolve(), f"{sequence}*.csv"))


class Spoiling(Job):
    """A recording with faults uses the images of its rendering, so its users count as users of the rendering."""

    @classmethod
    def added(cls, plan, name, render, spoilers):
        argv = [sys.executable, str(SPOIL), str(render.folder), "--out", OUT, "--what", *spoilers]
        job = cls("recording", name, plan.work / "recordings" / name, [Command(argv)], needs=[render], outside=[SPOIL])
        job.render = render
        plan.jobs.append(job)
        return job

    @property
    def users(self):
        return self.render.users
