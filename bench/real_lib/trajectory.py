"""Trajectories as sorted lists of (stamp in seconds, (q, p)), and the files that contain them.

A reference may be in pieces if structure from motion did not join all images. A line '# piece' in the file begins one in a frame and a
scale of its own; a hole in time ends a piece too, but both pieces share the frame.
"""

import bisect
import math
from dataclasses import dataclass
from pathlib import Path

from ablation_lib.recording import numbers
from generalization_lib.paths import quaternion
from real_lib import rotations as rot

PIECE_MARK = "# piece"
HOLE_S = 5.0  # a longer time between two poses of a reference begins the next piece
MAX_GAP_S = 0.6  # longest gap that is interpolated


@dataclass
class Piece:
    poses: list
    frame: int  # pieces of one frame may be compared with each other


def read_pieces(path):
    frames = [[]]
    for line in Path(path).read_text().splitlines():
        if line.startswith(PIECE_MARK):
            frames.append([])
        elif line and line[0] != "#":
            stamp, *values = (float(word) for word in line.split())
            frames[-1].append((stamp, (rot.normalised((values[6], *values[3:6])), tuple(values[:3]))))
    return [Piece(poses, i) for i, frame in enumerate(frames) for poses in split_at_holes(sorted(frame))]


def split_at_holes(poses):
    pieces = []
    for pose in poses:
        if not pieces or pose[0] - pieces[-1][-1][0] > HOLE_S:
            pieces.append([])
        pieces[-1].append(pose)
    return pieces


def grown(pieces, scale):
    return [Piece([(t, (q, rot.scaled(scale, p))) for t, (q, p) in piece.poses], piece.frame) for piece in pieces]


def read(path):
    """All poses of the file in one frame, with any number of holes."""
    return sorted(pose for piece in read_pieces(path) for pose in piece.poses)


def tum(poses):
    return "".join(f"{t:.9f} " + " ".join(f"{x:.9f}" for x in (*p, *q[1:], q[0])) + "\n" for t, (q, p) in poses)


def read_groundtruth(csv):
    """EuRoC's ground truth of the rig: nanoseconds, position, quaternion w x y z."""
    poses = []
    for line in Path(csv).read_text().splitlines():
        if line and line[0].isdigit():
            ns, *values = line.split(",")[:8]
            p, q = tuple(map(float, values[:3])), tuple(map(float, values[3:7]))
            poses.append((int(ns) // 1000 / 1e6, (rot.normalised(q), p)))
    return sorted(poses)


def extrinsics(sensor_yaml):
    """T_BS."""
    m = numbers(Path(sensor_yaml).read_text(), "data")
    x, y, z, w = quaternion([m[0:3], m[4:7], m[8:11]])
    return (w, x, y, z), (m[3], m[7], m[11])


def moved(poses, T):
    """The poses of an object at T in the moving frame, for instance the camera's poses from the body's."""
    return [(t, rot.compose(pose, T)) for t, pose in poses]


def at(poses, stamps, t, max_gap_s=MAX_GAP_S):
    """The pose at t, interpolated between its neighbours; None outside the trajectory, and in a hole."""
    i = bisect.bisect_left(stamps, t)
    if i < len(stamps) and stamps[i] - t < 1e-6:
        return poses[i][1]
    if i > 0 and t - stamps[i - 1] < 1e-6:
        return poses[i - 1][1]
    if i in (0, len(stamps)) or stamps[i] - stamps[i - 1] > max_gap_s:
        return None
    share = (t - stamps[i - 1]) / (stamps[i] - stamps[i - 1])
    (q0, p0), (q1, p1) = poses[i - 1][1], poses[i][1]
    return rot.slerp(q0, q1, share), tuple(a + share * (b - a) for a, b in zip(p0, p1))


def stamps_of(poses):
    return [t for t, _ in poses]


def period(poses):
    steps = sorted(b[0] - a[0] for a, b in zip(poses, poses[1:]))
    return steps[len(steps) // 2] if steps else math.inf


def pairs(estimate, reference, shift_s=0.0):
    """(stamp, estimate's pose, reference's pose) at the stamps of the sparser one; the estimate's clock is ahead by the shift."""
    if period(reference) > period(estimate):
        stamps = stamps_of(estimate)
        known = ((t, at(estimate, stamps, t + shift_s), pose) for t, pose in reference)
    else:
        stamps = stamps_of(reference)
        known = ((t - shift_s, pose, at(reference, stamps, t - shift_s)) for t, pose in estimate)
    return [pair for pair in known if None not in pair]


def path_m(positions):
    return sum(math.dist(a, b) for a, b in zip(positions, positions[1:]))


def at_camera_rate(keyframes, odometry, max_gap_s=6.0):
    """The optimised keyframes with the odometry's motion between them: each pose is a mean of its positions by both neighbours, of which the nearer
    has more weight. A keyframe without a pose of the odometry is left out."""
    own = dict(odometry)
    stamps = stamps_of(odometry)
    corrections = []
    for t, pose in keyframes:
        raw = own.get(t) or at(odometry, stamps, t)
        if raw:
            corrections.append((t, rot.compose(pose, rot.inverse(raw))))
    times = stamps_of(corrections)
    dense = []
    for t, pose in odometry:
        correction = at(corrections, times, t, max_gap_s) if corrections else None
        if correction:
            dense.append((t, _blended(corrections, times, t, pose)))
    return dense


def _blended(corrections, times, t, pose):
    """Blends the poses, not the corrections: an interpolated correction's rotation would act far from the origin of its frame."""
    j = min(max(bisect.bisect_left(times, t), 1), len(times) - 1) if len(times) > 1 else 0
    i = max(j - 1, 0)
    a, b = (rot.compose(corrections[k][1], pose) for k in (i, j))
    share = 0.0 if i == j else (t - times[i]) / (times[j] - times[i])
    return rot.slerp(a[0], b[0], share), tuple(x + share * (y - x) for x, y in zip(a[1], b[1]))
