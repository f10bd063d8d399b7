"""Paths with motions that neither EuRoC nor the simulator's generator has: pauses, rotations on the spot, driving.

Each path is a speed over time, and the camera's position, yaw, pitch and roll from the time and the distance covered (z up, metres,
radians). Written as TUM poses of the body behind EuRoC's cam0.
"""

import math
from dataclasses import dataclass
from typing import Callable

RATE_HZ = 40
SUBSTEPS = 25  # steps of the speed's integral between two poses
# EuRoC's cam0, as all extrinsics: rows of the rotation of T_body_cam, and its translation.
R_BODY_CAM = ((0.0148655429818, -0.999880929698, 0.00414029679422), (0.999557249008, 0.0149672133247, 0.025715529948),
              (-0.0257744366974, 0.00375618835797, 0.999660727178))
P_BODY_CAM = (-0.0216401454975, -0.064676986768, 0.00981073058949)
EUROC = (R_BODY_CAM, P_BODY_CAM)


def smooth(x):
    """Smooth step from 0 to 1 over 0 .. 1, without speed and acceleration at both ends."""
    x = min(1.0, max(0.0, x))
    return x * x * x * (x * (6 * x - 15) + 10)


def within(t, begin, end, soft=0.8):
    return smooth((t - begin) / soft) - smooth((t - end) / soft)


def eight(s):
    """Position on a figure of eight at arc length s, and the direction there."""
    phase = s / 2.2
    return 2.0 * math.sin(phase), 0.9 * math.sin(2 * phase), math.atan2(1.8 * math.cos(2 * phase), 2.0 * math.cos(phase))


def walker(t, s, rotated=0.0):
    x, y, yaw = eight(s)
    return (x, y, 1.5 + 0.02 * math.sin(2 * math.pi * 1.7 * t)), yaw + rotated, 0.04 * math.sin(0.9 * t), 0.03 * math.sin(1.3 * t)


def driver(t, s):
    up, side = 0.01 * math.sin(2 * math.pi * 1.5 * t), 0.15 * math.sin(0.5 * t)
    return (s, side, 1.4 + up), 0.03 * math.sin(0.5 * t), 0.008 * math.sin(8 * t), 0.006 * math.sin(7 * t)


@dataclass(frozen=True)
class Way:
    speed: Callable  # m/s, as a function of time
    camera: Callable  # position, yaw, pitch, roll, from the time and the metres covered


WAYS = {
    # Stops for 8 s and for 14 s; the hand trembles only while it walks.
    "stands": Way(lambda t: 0.8 * (1 - within(t, 9, 17) - within(t, 26, 40)), lambda t, s: walker(s / 0.8, s)),
    # Stands on the spot and rotates twice in 16 s.
    "turns": Way(lambda t: 0.8 * (1 - within(t, 10, 26)), lambda t, s: walker(t, s, 4 * math.pi * smooth((t - 10) / 16))),
    "drives": Way(lambda t: 5 * smooth(t / 6), driver),
}


def product(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(3)) for j in range(3)] for i in range(3)]


def body_pose(position, yaw, pitch, roll, extrinsics=EUROC):
    """Rotation and position of the body for a camera at this position with this yaw, pitch and roll."""
    R_body_cam, p_body_cam = extrinsics
    (cy, sy), (cp, sp), (cr, sr) = ((math.cos(a), math.sin(a)) for a in (yaw, pitch, roll))
    level = [[0, 0, 1], [-1, 0, 0], [0, -1, 0]]  # looks along x
    R = product([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]], product([[1, 0, 0], [0, cr, -sr], [0, sr, cr]], level))
    R = product(product([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]], R), [list(column) for column in zip(*R_body_cam)])
    return R, [p - sum(r * c for r, c in zip(row, p_body_cam)) for p, row in zip(position, R)]


def quaternion(R):
    """x, y, z, w, from the column of 4 q q^T with the largest diagonal (Shepperd, 1978)."""
    d = [R[0][0], R[1][1], R[2][2]]
    w = 1 + sum(d)
    columns = [[1 + 2 * d[0] - sum(d), R[0][1] + R[1][0], R[0][2] + R[2][0], R[2][1] - R[1][2]],
               [R[0][1] + R[1][0], 1 + 2 * d[1] - sum(d), R[1][2] + R[2][1], R[0][2] - R[2][0]],
               [R[0][2] + R[2][0], R[1][2] + R[2][1], 1 + 2 * d[2] - sum(d), R[1][0] - R[0][1]],
               [R[2][1] - R[1][2], R[0][2] - R[2][0], R[1][0] - R[0][1], w]]
    q = columns[max(range(4), key=lambda i: columns[i][i])]
    return [x / math.hypot(*q) for x in q]


def tum(way, seconds):
    lines, gone, step = [], 0.0, 1 / (RATE_HZ * SUBSTEPS)
    for i in range(int(RATE_HZ * seconds) + 1):
        R, p = body_pose(*way.camera(i / RATE_HZ, gone))
        lines.append(" ".join([f"{1000 + i / RATE_HZ:.6f}", *(f"{x:.9f}" for x in p + quaternion(R))]))
        gone += step * sum(way.speed(i / RATE_HZ + (k + 0.5) * step) for k in range(SUBSTEPS))
    return "\n".join(lines) + "\n"
