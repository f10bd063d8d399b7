"""Compares a trajectory of camera poses with a reference, which may be in pieces; a scale is the estimate's relative to the reference's."""

import bisect
import itertools
import math
from dataclasses import dataclass

from real_lib import rotations as rot
from real_lib import trajectory
from real_lib.alignment import centred, common_scale, rmse
from real_lib.cycles import nees_of

MIN_POSES = 8  # for a piece, or for a half of it
SHIFT_S, SHIFT_STEP_S = 0.1, 0.005  # range of the search, in both directions, and its step
REVISIT_APART_S = 10.0
REVISIT_M, REVISIT_RAD = 1.0, math.radians(45)  # between two camera poses that see the same place
REVISIT_STEP_S = 0.4  # between the poses that are paired
STEP_S = 1.0  # of a_second
WRONG_M, WRONG_RAD = 0.5, math.radians(5)
ACROSS = 2  # factor on the bounds between pieces, because a reference is less accurate where they join


@dataclass
class Matched:
    """One piece of the reference, with the estimate's poses: (stamp, estimate, reference)."""

    frame: int
    pairs: list

    def fit(self, begin=-math.inf, end=math.inf):
        pairs = [pair for pair in self.pairs if begin <= pair[0] < end]
        if len(pairs) < MIN_POSES:
            return None
        return centred([e[1] for _, e, _ in pairs], [r[1] for _, _, r in pairs])


def matched(estimate, pieces, shift_s=0.0):
    return [Matched(piece.frame, trajectory.pairs(estimate, piece.poses, shift_s)) for piece in pieces]


def best_shift(estimate, pieces):
    """How far another system's stamps, which may be in its IMU's clock, are ahead of the images': the shift with the smallest ATE."""
    steps = round(SHIFT_S / SHIFT_STEP_S)

    def error(step):
        fits = [m.fit() for m in matched(estimate, pieces, step * SHIFT_STEP_S)]
        squared = [x for fit in fits if fit for x in fit.squared(fit.scale())]
        return rmse(squared) if squared else math.inf

    return SHIFT_STEP_S * min(range(-steps, steps + 1), key=lambda step: (error(step), abs(step)))


def main_frame(fits):
    """The fits in the frame with most poses: only these share a scale."""
    frames = [frame for frame, _ in fits]
    most = max(frames, key=lambda frame: sum(len(fit.estimate) for f, fit in fits if f == frame))
    return [fit for frame, fit in fits if frame == most]


def scale_within(pieces, begin=-math.inf, end=math.inf):
    fits = [(m.frame, fit) for m in pieces if (fit := m.fit(begin, end))]
    return common_scale(main_frame(fits)) if fits else None


def measure(estimate, pieces, shift=0.0):
    """Returns None if both have too few poses in common."""
    known = matched(estimate, pieces, shift)
    fits = [(m.frame, fit) for m in known if (fit := m.fit())]
    if not fits:
        return None
    squared = [x for _, fit in fits for x in fit.squared(fit.scale())]
    path = sum(abs(fit.scale()) * trajectory.path_m(fit.reference) for _, fit in fits)
    stamps = sorted(pair[0] for m in known for pair in m.pairs)
    middle = (stamps[0] + stamps[-1]) / 2
    first, second = scale_within(known, end=middle), scale_within(known, begin=middle)
    scale = common_scale(main_frame(fits))
    covered = sum(len(m.pairs) for m in known)
    result = {"ate_m": rmse(squared), "path_m": path, "ate_share": rmse(squared) / path if path > 0 else None,
              "scale": scale, "piece_scales": [fit.scale() for _, fit in fits],
              "drift": second / first if first and second else None, "shift_s": shift, "poses": covered,
              "coverage": covered / max(covered, sum(expected(estimate, piece) for piece in pieces))}
    result["revisits"] = revisits(known, scale)
    result["a_second"] = a_second(known, scale)
    return result


def expected(estimate, piece):
    """The number of pairs if the whole piece were covered."""
    period = max(trajectory.period(piece.poses), trajectory.period(estimate))
    return 1 + math.floor((piece.poses[-1][0] - piece.poses[0][0]) / period) if math.isfinite(period) else len(piece.poses)


def near(a, b):
    """Whether two camera poses see the same place."""
    T = rot.between(a, b)
    ahead = rot.rotate(T[0], (0.0, 0.0, 1.0))
    return math.hypot(*T[1]) <= REVISIT_M and math.acos(max(-1.0, min(1.0, ahead[2]))) <= REVISIT_RAD


def revisits(known, scale):
    """Errors of relative poses of revisited places, in the reference's metres: the odometry's drift where a loop may be closed."""
    return errors(((a, b) for pairs in same_frame(known) for a, b in itertools.combinations(spaced(plain(pairs)), 2)
                   if b[0] - a[0] >= REVISIT_APART_S and near(a[2], b[2])), scale)


def a_second(known, scale):
    """Errors of relative poses a second apart. An odometry hardly drifts in a second: for an odometry they tell how accurate the reference is."""
    def apart():
        for pairs in same_frame(known):
            nodes = plain(pairs)
            stamps = [t for t, _, _ in nodes]
            for a in nodes:
                i = bisect.bisect_left(stamps, a[0] + STEP_S)
                if i < len(nodes) and stamps[i] - a[0] < 1.5 * STEP_S:
                    yield a, nodes[i]
    return errors(apart(), scale)


def plain(pairs):
    return [pair for _, pair in pairs]


def errors(two_poses, scale):
    """Medians of the errors of relative poses; each pose is (stamp, estimate, reference)."""
    off = [difference(rot.between(a[1], b[1]), rot.between(a[2], b[2]), scale) for a, b in two_poses]
    if not off:
        return {"pairs": 0, "median_m": None, "median_deg": None}
    metres, radians = zip(*off)
    return {"pairs": len(off), "median_m": middle_of(metres), "median_deg": math.degrees(middle_of(radians))}


def same_frame(known):
    """For each frame its (piece, pair), in the order of time."""
    for frame in {m.frame for m in known}:
        yield sorted(((i, pair) for i, m in enumerate(known) if m.frame == frame for pair in m.pairs), key=lambda item: item[1][0])


def spaced(nodes):
    kept = []
    for node in nodes:
        if not kept or node[0] - kept[-1][0] >= REVISIT_STEP_S:
            kept.append(node)
    return kept


def difference(T_estimate, T_reference, scale):
    """Distance in metres of the reference, and angle in radians."""
    off = rot.subtract(rot.scaled(1 / scale, T_estimate[1]), T_reference[1]) if scale else T_reference[1]
    return math.hypot(*off), rot.angle(rot.multiply(rot.conjugate(T_estimate[0]), T_reference[0]))


def middle_of(values):
    return sorted(values)[len(values) // 2]


def mean_and_median(values):
    return {"number": len(values), "mean": sum(values) / len(values) if values else None, "median": middle_of(values) if values else None}


def check_constraints(constraints, pieces, scale, T_body_cam):
    """Checks the accepted constraints (from stamp, to stamp, T_from_to of the bodies, covariance) that the reference
    covers: checked, wrong, of revisits, NEES.

    Wrong within one piece: an error above WRONG_M or WRONG_RAD; between two pieces of one frame: ACROSS times as much."""
    result = {"checked": 0, "wrong": 0, "revisits": 0, "median_m": None, "median_deg": None}
    metres, radians, nees = [], [], []
    for t, u, T_from_to, covariance in constraints:
        a, b = (in_pieces(pieces, stamp) for stamp in (t, u))
        result["revisits"] += abs(t - u) >= REVISIT_APART_S
        if not a or not b or a[0].frame != b[0].frame:
            continue
        T = rot.compose(rot.compose(rot.inverse(T_body_cam), T_from_to), T_body_cam)
        expected_q, expected_p = rot.between(a[1], b[1])
        m, r = difference(T, (expected_q, expected_p), scale)
        T_expected = rot.compose(rot.compose(T_body_cam, (expected_q, rot.scaled(scale or 1, expected_p))), rot.inverse(T_body_cam))
        nees.append(nees_of(T_from_to, T_expected, covariance))
        bound = 1 if a[0] is b[0] else ACROSS
        result["checked"] += 1
        result["wrong"] += m > bound * WRONG_M or r > bound * WRONG_RAD
        metres.append(m)
        radians.append(r)
    result["nees"] = mean_and_median(nees)
    if metres:
        result.update(median_m=middle_of(metres), median_deg=math.degrees(middle_of(radians)))
    return result


def in_pieces(pieces, t):
    for piece in pieces:
        pose = trajectory.at(piece.poses, trajectory.stamps_of(piece.poses), t)
        if pose:
            return piece, pose
    return None
