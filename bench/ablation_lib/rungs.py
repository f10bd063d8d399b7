"""What the odometry is given: everything exact, then one thing after the other as a real sensor gives it.

A rung of the ladder keeps what the rungs above it took away. Beside the ladder stand IMU and calibration, which show without
the tracker: each of their errors alone, all else exact.
"""

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Given:
    tracks: str = "exact"  # or followed: by the odometry's own tracker
    images: str = "perfect"  # or noisy: exposure changes and pixel noise; or full: motion blur as well
    imu_noise: bool = False
    imu_bias: bool = False
    imu_recorded: bool = False  # EuRoC's own, and images rendered at its camera's stamps
    calibration: tuple = ()  # what is wrong of CALIBRATION

    @property
    def seeded(self):
        return self != replace(Given(), tracks=self.tracks)


@dataclass(frozen=True)
class Rung:
    name: str  # of its products
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
# The real thing: a recorded IMU beside images with noise and blur, calibration exact.
RECORDED = Rung("imu_recorded", "recorded IMU, exact calibration", Given(tracks="followed", images="full", imu_recorded=True))
