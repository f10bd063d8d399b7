"""Paths of people and drones through halls, along rounded corners, as TUM poses of the body.

A path depends only on time, so it can be cut anywhere; all move from the first frame on.
"""

import math
from dataclasses import dataclass

from generalization_lib.paths import EUROC, RATE_HZ, body_pose, quaternion

# The simulator's phone and wide lens: held upright in landscape, the body's z out of the screen.
PHONE = (((0, 1, 0), (1, 0, 0), (0, 0, -1)), (0.04, 0.01, -0.005))
EXTRINSICS = {"euroc": EUROC, "phone": PHONE, "wide": PHONE}
ROUNDING_M = 1.6  # to either side of a corner
SAMPLES = 24  # for the mean over a rounding


@dataclass(frozen=True)
class Way:
    corners: tuple  # points on the ground, metres; if the last equals the first, the path goes round and round
    flies: bool = False  # otherwise a walk with a camera in the hand
    speed: float = 1.2  # m/s, on average
    height: float = 1.5  # m, on average
    looks: float = 0  # degrees, to the left of the direction of motion
    start: float = 0  # metres along the corners


def along(corners, s):
    """The point s metres along the corners; before the first and beyond the last the path is straight."""
    legs = [math.dist(a, b) for a, b in zip(corners, corners[1:])]
    if corners[0] == corners[-1]:
        s %= sum(legs)
    i = 0
    while i + 1 < len(legs) and s > legs[i]:
        s -= legs[i]
        i += 1
    (ax, ay), (bx, by) = corners[i], corners[i + 1]
    return ax + (bx - ax) * s / legs[i], ay + (by - ay) * s / legs[i]


def rounded(corners, s):
    """Weighted mean of the points nearby, with the largest weight for the nearest: twice differentiable at a corner."""
    steps = [2 * (k + 0.5) / SAMPLES - 1 for k in range(SAMPLES)]
    weights = [1 + math.cos(math.pi * u) for u in steps]
    points = [along(corners, s + ROUNDING_M * u) for u in steps]
    return [sum(w * p[axis] for w, p in zip(weights, points)) / sum(weights) for axis in (0, 1)]


def camera(way, t):
    """Position, yaw, pitch and roll of the camera."""
    def wave(hz, phase=0.0):
        return math.sin(2 * math.pi * hz * t + phase)

    s = way.start + way.speed * (t + 0.25 * (1 - math.cos(0.5 * t)) / 0.5)
    x, y = rounded(way.corners, s)
    (ax, ay), (bx, by) = rounded(way.corners, s - 0.3), rounded(way.corners, s + 0.3)
    heading = math.atan2(by - ay, bx - ax)
    yaw = heading + math.radians(way.looks) + 0.25 * wave(0.07) + 0.1 * wave(0.19, 1)
    if way.flies:
        aside, up = 0.3 * wave(0.21), 0.4 * wave(0.13, 2)
        pitch, roll = 0.12 * wave(0.11, 1) + 0.008 * wave(3.1), 0.08 * wave(0.21, 2) + 0.008 * wave(2.7)
    else:
        aside, up = 0.02 * wave(0.9) + 0.1 * wave(0.1), 0.02 * wave(1.8) + 0.08 * wave(0.12, 2)
        pitch, roll = 0.1 * wave(0.09) + 0.015 * wave(1.8, 1), 0.05 * wave(0.23) + 0.012 * wave(0.9, 1)
        yaw += 0.015 * wave(0.9, 2)
    return (x - aside * math.sin(heading), y + aside * math.cos(heading), way.height + up), yaw, pitch, roll


def tum(way, seconds, lens):
    lines = []
    for i in range(int(RATE_HZ * seconds) + 1):
        R, p = body_pose(*camera(way, i / RATE_HZ), EXTRINSICS[lens])
        lines.append(" ".join([f"{1000 + i / RATE_HZ:.6f}", *(f"{x:.9f}" for x in p + quaternion(R))]))
    return "\n".join(lines) + "\n"
