"""Rotations as quaternions (w, x, y, z), and rigid transforms (q, p): p_a = q * p_b + p."""

import math


def multiply(a, b):
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return (aw * bw - ax * bx - ay * by - az * bz, aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx, aw * bz + ax * by - ay * bx + az * bw)


def conjugate(q):
    return (q[0], -q[1], -q[2], -q[3])


def normalised(q):
    length = math.hypot(*q)
    return tuple(x / length for x in q)


def rotate(q, v):
    return multiply(multiply(q, (0.0, *v)), conjugate(q))[1:]


def angle(q):
    """Radians, 0 to pi."""
    return 2 * math.atan2(math.hypot(*q[1:]), abs(q[0]))


def rotation_vector(q):
    """Log of the rotation, radians; its length is at most pi."""
    q = q if q[0] >= 0 else tuple(-x for x in q)
    half = math.hypot(*q[1:])
    return scaled(2 * math.atan2(half, q[0]) / half if half > 1e-12 else 2.0, q[1:])


def cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def slerp(a, b, share):
    if sum(x * y for x, y in zip(a, b)) < 0:
        b = tuple(-x for x in b)
    step = multiply(conjugate(a), b)
    half = math.atan2(math.hypot(*step[1:]), step[0])
    if half < 1e-9:
        return a
    k = math.sin(share * half) / math.sin(half)
    return normalised(multiply(a, (math.cos(share * half), *(k * x for x in step[1:]))))


def add(a, b):
    return tuple(x + y for x, y in zip(a, b))


def subtract(a, b):
    return tuple(x - y for x, y in zip(a, b))


def scaled(k, v):
    return tuple(k * x for x in v)


def compose(A, B):
    return multiply(A[0], B[0]), add(rotate(A[0], B[1]), A[1])


def apply(A, p):
    return add(rotate(A[0], p), A[1])


def inverse(A):
    q = conjugate(A[0])
    return q, scaled(-1, rotate(q, A[1]))


def between(A, B):
    """T_A_B of two poses in one frame."""
    return compose(inverse(A), B)
