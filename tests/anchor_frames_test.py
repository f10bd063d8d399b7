#!/usr/bin/env python3
"""Tests the conversions of examples/anchors to the frames of Unity, three.js and WebXR, evaluated from its text: points transform alike."""

import ast
import math
import random
import re
import unittest
from pathlib import Path

FOLDER = Path(__file__).resolve().parents[1] / "examples/anchors"
CODE = "".join((FOLDER / name).read_text() for name in ("unity.cs", "three.js"))


def evaluated(pattern, **names):
    """The arguments of a call with this text in the examples, as numbers."""
    found = re.search(re.escape(pattern) + r"\(([^)]*)\)", CODE)
    assert found, pattern
    tree = ast.parse(found[1].replace("p.position", "t"), mode="eval")
    return eval(compile(tree, pattern, "eval"), {}, names)  # noqa: S307: of our own page


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def rotated(q, v):
    """v rotated by the quaternion (x, y, z, w), by the formula of all of these systems."""
    u, w = q[:3], q[3]
    uv = cross(u, v)
    uuv = cross(u, uv)
    return tuple(v[i] + 2 * (w * uv[i] + uuv[i]) for i in range(3))


class Frames(unittest.TestCase):
    """The conversions, evaluated from the text of the examples."""

    @staticmethod
    def unity(t, q):
        return evaluated("new Vector3", t=t), evaluated("new Quaternion", q=q)

    @staticmethod
    def three(t, q):
        (x, y, z), (qw, qx, qy, qz) = t, q
        return (evaluated("object.position.set", x=x, y=y, z=z),
                evaluated("object.quaternion.set", qw=qw, qx=qx, qy=qy, qz=qz))

    def test_points_transform_alike(self):
        draw = random.Random(1)
        for convert in (self.unity, self.three):
            for _ in range(100):
                t, p = ([draw.uniform(-5, 5) for _ in range(3)] for _ in range(2))
                q = [draw.gauss(0, 1) for _ in range(4)]
                q = [c / math.hypot(*q) for c in q]  # w, x, y, z
                p_map = [a + b for a, b in zip(rotated((*q[1:], q[0]), p), t)]
                t_there, q_there = convert(t, q)
                p_there, _ = convert(p, q)
                expected, _ = convert(p_map, q)
                for a, b, c in zip(rotated(q_there, p_there), t_there, expected):
                    self.assertAlmostEqual(a + b, c, places=9)

    def test_axes(self):
        ours = {"forward": (1, 0, 0), "left": (0, 1, 0), "up": (0, 0, 1)}
        there = {self.unity: {"forward": (0, 0, 1), "left": (-1, 0, 0), "up": (0, 1, 0)},
                 self.three: {"forward": (0, 0, -1), "left": (-1, 0, 0), "up": (0, 1, 0)}}
        for convert, axes in there.items():
            for name, axis in axes.items():
                self.assertEqual(tuple(convert(ours[name], (1, 0, 0, 0))[0]), axis, name)


if __name__ == "__main__":
    unittest.main()
