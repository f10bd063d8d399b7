#!/usr/bin/env python3
"""Tests examples/anchors: its conversions to the frames of Unity, three.js and WebXR, evaluated from its text, and which anchors it draws."""

import ast
import math
import random
import re
import shutil
import subprocess
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


SOCKET = """
const drawn = new Set();
let socket;
globalThis.WebSocket = class { constructor() { socket = this; } };
const object = ({name}) => ({position: {set() {}}, quaternion: {set() {}}, name, removeFromParent() { drawn.delete(name); }});
const showGroup = listen("", {add: (object) => drawn.add(object.name)}, object);
const tell = (id, group, type = "anchor") =>
  socket.onmessage({data: JSON.stringify({type, id, name: id, ...(type === "gone" ? {} : {group, pose: {position: [1, 2, 3], orientation: [1, 0, 0, 0]}})})});
const say = () => console.log([...drawn].sort().join(" "));
"""


@unittest.skipUnless(shutil.which("node"), "needs node")
class Groups(unittest.TestCase):
    """Each group has a map frame of its own, so only one's own group is drawn."""

    def drawn(self, script):
        code = (FOLDER / "three.js").read_text() + SOCKET + script
        return subprocess.run(["node", "-e", code], capture_output=True, text=True, check=True).stdout.split("\n")[:-1]

    def test_three_draws_the_own_group(self):
        self.assertEqual(self.drawn("""
            tell("a", "1/5"); tell("b", "2/6"); say();
            showGroup("2/6"); say();
            tell("c", "2/6"); say();
            showGroup("1/5"); tell("c", "1/5"); say();
            tell("a", "", "gone"); showGroup("1/5"); say();"""), ["", "b", "b c", "a c", "c"])

    def test_three_forgets_what_was_deleted_before_it_connected_again(self):
        self.assertEqual(self.drawn("""
            showGroup("1/5"); socket.onopen(); tell("a", "1/5"); tell("b", "1/5"); say();
            globalThis.setTimeout = (again) => again();
            const first = socket; first.onclose(); console.log(first === socket); say();
            socket.onopen(); tell("b", "1/5"); showGroup("1/5"); say();"""), ["a b", "false", "a b", "b"])


if __name__ == "__main__":
    unittest.main()
