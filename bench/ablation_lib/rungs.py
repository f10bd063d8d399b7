"""The input of the odometry at each rung: everything exact, then one error of a real sensor after the other.

A rung of the ladder keeps the errors of the rungs above it. Errors of IMU and calibration are also tested beside the ladder, without
the tracker: each error alone, with everything else exact.
"""

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Given:
    tracks: str = "exact"  # or followed: tracked by the odometry's own tracker
    images: str = "perfect"  # or noisy: exposure changes and pixel noise; or full: motion blur as well
    imu_noise: bool = False
    imu_bias: bool = False
    imu_recorded: bool = False  # EuRoC's own samples, with images rendered at the stamps of its camera
    calibration: tuple = ()  # the wrong parts of CALIBRATION

    @property
    def seeded(self):
        return self != replace(Given(), tracks=self.tracks)


@dataclass(frozen=True)
class Rung:
    name: str  # used in the names of its products
    title: str
    given: Given


CALIBRATION = ("extrinsics", "time_offset", "intrinsics")
_IMU = [("imu_noise", "IMU noise", {"imu_noise": True}), ("imu_bias", "IMU biases", {"imu_bias": True})]
_STEPS = [
    ("tracker", "features followed in the images", {"tracks": "followed"}),
    ("pixel_noise", "exposure changes, pixel noise", {"images": "noisy"}),
    ("blur", "motion blur", {"images": "full"}),
    *_IMU,
    ("calibration", "calibration off", {"calibration": CALIBRATION}),
]
_OFF = [(what, what.replace("_", " ") + " off", {"calibration": (what,)}) for what in CALIBRATION]


def _ladder():
    given = Given()
    yield Rung("exact", "all exact", given)
    for name, title, change in _STEPS:
        given = replace(given, **change)
        yield Rung(name, "+ " + title, given)


LADDER = list(_ladder())
ALONE = [Rung("only_" + name, title, replace(Given(), **change)) for name, title, change in _IMU + _OFF]
# The real case: a recorded IMU with images that have noise and blur; the calibration is exact.
RECORDED = Rung("imu_recorded", "recorded IMU, exact calibration", Given(tracks="followed", images="full", imu_recorded=True))
