"""How well accepted constraints agree with each other, without a reference: two that join the same places within NEAR seconds make a
cycle with the odometry between their ends, and its error should be as large as the covariances say.

Errors that both constraints share cannot be seen; what a reference adds of its own errors is not there either.
"""

import itertools
import math

from real_lib import rotations as rot

NEAR_S = 2.0  # between the ends of two constraints
DRIFT_M, DRIFT_RAD = 0.01, 0.0005  # sigmas of the odometry: per metre between the ends, of each of its two rotations


def nees(found, motion):
    """NEES per dimension of each cycle. `found`: {(map, map): [(seconds, seconds, T_from_to, covariance)]}; motion(map, t, u): T_t_u of its
    odometry's keyframes, or None."""
    return [value for maps, constraints in found.items() for k, l in itertools.combinations(constraints, 2)
            if abs(k[0] - l[0]) <= NEAR_S and abs(k[1] - l[1]) <= NEAR_S and (value := _of_cycle(k, l, maps, motion)) is not None]


def _of_cycle(k, l, maps, motion):
    before, after = motion(maps[0], k[0], l[0]), motion(maps[1], l[1], k[1])
    if not before or not after:
        return None
    predicted = rot.compose(rot.compose(before, l[2]), after)
    covariance = _sum(k[3], _moved(l[3], before[0], rot.rotate(l[2][0], after[1])))
    metres = math.hypot(*before[1]) + math.hypot(*after[1])
    for i in range(6):
        covariance[i][i] += (DRIFT_M * metres) ** 2 if i < 3 else 2 * DRIFT_RAD ** 2
    return nees_of(k[2], predicted, covariance)


def nees_of(T, T_expected, covariance):
    """Per dimension; covariance of (translation, rotation), both in the left frame (docs/conventions.md)."""
    error = [*rot.subtract(T[1], T_expected[1]), *rot.rotation_vector(rot.multiply(T[0], rot.conjugate(T_expected[0])))]
    return sum(e * x for e, x in zip(error, solved(covariance, error))) / 6


def _moved(covariance, q, arm):
    """The covariance of (translation, rotation) at a point `arm` further, in axes rotated by q."""
    J = [[0.0] * 6 for _ in range(6)]
    for column in range(3):
        axis = tuple(float(i == column) for i in range(3))
        rotated, swept = rot.rotate(q, axis), rot.rotate(q, rot.cross(axis, arm))
        for row in range(3):
            J[row][column] = J[row + 3][column + 3] = rotated[row]
            J[row][column + 3] = swept[row]
    return _product(_product(J, covariance), [list(row) for row in zip(*J)])


def _product(a, b):
    return [[sum(x * y for x, y in zip(row, column)) for column in zip(*b)] for row in a]


def _sum(a, b):
    return [[x + y for x, y in zip(*rows)] for rows in zip(a, b)]


def solved(matrix, right):
    """x of matrix x = right, for a positive definite matrix."""
    rows = [[*row, value] for row, value in zip(matrix, right)]
    for i, pivot in enumerate(rows):
        for row in rows[i + 1:]:
            factor = row[i] / pivot[i]
            row[:] = [x - factor * y for x, y in zip(row, pivot)]
    x = [0.0] * len(rows)
    for i in reversed(range(len(rows))):
        x[i] = (rows[i][-1] - sum(a * b for a, b in zip(rows[i][i + 1:-1], x[i + 1:]))) / rows[i][i]
    return x
