"""Sim(3) alignment of camera centres: estimate = s R reference + t, so s is the estimate's scale if the reference is metric.

Rotation by Horn's quaternions (1987), scale and residuals by Umeyama (1991), in the estimate's own metres.
"""

import math
from dataclasses import dataclass

from real_lib import rotations as rot


def largest_eigenvector(matrix, sweeps=30):
    """Eigenvector of a symmetric matrix, by Jacobi's rotations."""
    n = len(matrix)
    a = [list(row) for row in matrix]
    v = [[float(i == j) for j in range(n)] for i in range(n)]
    for _ in range(sweeps):
        off = sum(a[i][j] ** 2 for i in range(n) for j in range(i))
        if off <= 1e-30 * sum(a[i][i] ** 2 for i in range(n)):
            break
        for p in range(n):
            for q in range(p + 1, n):
                _eliminate(a, v, p, q)
    best = max(range(n), key=lambda i: a[i][i])
    return [row[best] for row in v]


def _eliminate(a, v, p, q):
    if a[p][q] == 0:
        return
    theta = (a[q][q] - a[p][p]) / (2 * a[p][q])
    t = math.copysign(1, theta) / (abs(theta) + math.hypot(theta, 1))
    c = 1 / math.hypot(t, 1)
    s = t * c
    for row in (*a, *v):
        row[p], row[q] = c * row[p] - s * row[q], s * row[p] + c * row[q]
    a[p], a[q] = [c * x - s * y for x, y in zip(a[p], a[q])], [s * x + c * y for x, y in zip(a[p], a[q])]


@dataclass
class Centred:
    """One piece: its moments about the means."""

    rotation: tuple  # reference to estimate
    covariance: float  # sum of estimate . R reference
    spread: float  # sum of reference^2
    estimate: list
    reference: list

    def scale(self):
        return self.covariance / self.spread if self.spread > 0 else math.nan

    def squared(self, scale):
        """The squared residuals at this scale."""
        return [math.dist(e, rot.scaled(scale, rot.rotate(self.rotation, r))) ** 2 for e, r in zip(self.estimate, self.reference)]


def centred(estimate, reference):
    n = len(estimate)
    means = [tuple(sum(p[k] for p in points) / n for k in range(3)) for points in (estimate, reference)]
    est = [rot.subtract(p, means[0]) for p in estimate]
    ref = [rot.subtract(p, means[1]) for p in reference]
    S = [[sum(r[i] * e[j] for r, e in zip(ref, est)) for j in range(3)] for i in range(3)]
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = S
    N = [[xx + yy + zz, yz - zy, zx - xz, xy - yx], [yz - zy, xx - yy - zz, xy + yx, zx + xz],
         [zx - xz, xy + yx, yy - xx - zz, yz + zy], [xy - yx, zx + xz, yz + zy, zz - xx - yy]]
    q = rot.normalised(largest_eigenvector(N))
    covariance = sum(sum(x * y for x, y in zip(e, rot.rotate(q, r))) for e, r in zip(est, ref))
    return Centred(q, covariance, sum(sum(x * x for x in r) for r in ref), est, ref)


def common_scale(pieces):
    """Common scale of pieces, each with a rotation and translation of its own."""
    spread = sum(piece.spread for piece in pieces)
    return sum(piece.covariance for piece in pieces) / spread if spread > 0 else math.nan


def rmse(squared):
    return math.sqrt(sum(squared) / len(squared)) if squared else math.nan
