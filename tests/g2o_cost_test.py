#!/usr/bin/env python3
"""Tests that the exported pose graph, before and after our 6-DoF solver, has by g2o's own definitions the cost that we report.

    tests/g2o_cost_test.py PANGEA_LOG LOG

The test uses no code of the project, only the file's numbers, g2o's error of an SE(3) edge, e = (t, q_xyz) of Z^-1 T_i^-1 T_j, and the sum of
e^T information e. Ours is the same error in another frame.
"""

import re
import subprocess
import sys
import tempfile

RELATIVE_TOLERANCE = 1e-6  # of printed digits


def multiply(a, b):
    """Product of two quaternions (x, y, z, w)."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz)


def rotate(q, v):
    conjugate = (-q[0], -q[1], -q[2], q[3])
    return multiply(multiply(q, (*v, 0)), conjugate)[:3]


def inverse(pose):
    t, q = pose
    q = (-q[0], -q[1], -q[2], q[3])
    return tuple(-x for x in rotate(q, t)), q


def compose(a, b):
    return tuple(x + y for x, y in zip(a[0], rotate(a[1], b[0]))), multiply(a[1], b[1])


def pose(words):
    t, q = tuple(map(float, words[:3])), tuple(map(float, words[3:7]))
    norm = sum(x * x for x in q) ** 0.5
    return t, tuple(x / norm for x in q)


def edge_cost(Z, T_i, T_j, upper):
    t, q = compose(inverse(Z), compose(inverse(T_i), T_j))
    sign = -1 if q[3] < 0 else 1
    error = (*t, *(sign * x for x in q[:3]))
    entries = iter(map(float, upper))  # the information's upper triangle, row by row
    return sum((1 if row == column else 2) * next(entries) * error[row] * error[column]
               for row in range(6) for column in range(row, 6))


def cost(path):
    with open(path) as file:
        lines = [line.split() for line in file]
    vertices = {words[1]: pose(words[2:9]) for words in lines if words[0] == "VERTEX_SE3:QUAT"}
    edges = [words for words in lines if words[0] == "EDGE_SE3:QUAT"]
    total = sum(edge_cost(pose(words[3:10]), vertices[words[1]], vertices[words[2]], words[10:31]) for words in edges)
    return len(vertices), len(edges), total


def check(said, path):
    """The cost that our program reports in `said`, its last number."""
    ours = re.search(r"(\d+) vertices, (\d+) edges, cost (?:[\d.]+ -> )?([\d.]+)", said)
    vertices, edges, theirs = cost(path)
    print(f"{said.strip()}; read here: {vertices} vertices, {edges} edges, cost {theirs:.3f}")
    assert (vertices, edges) == (int(ours[1]), int(ours[2])), "not the same graph"
    assert theirs > 1 and abs(theirs / float(ours[3]) - 1) < RELATIVE_TOLERANCE, "not the same cost"
    return theirs


def main():
    program, log = sys.argv[1:]

    def run(*words):
        return subprocess.run([program, *words], check=True, capture_output=True, text=True).stdout

    with tempfile.TemporaryDirectory() as folder:
        path, solved, taken = f"{folder}/graph.g2o", f"{folder}/solved.g2o", f"{folder}/taken.lcm"
        exported = check(run("export", log, "--g2o", path), path)
        assert check(run("solve", path, "--out", solved), solved) < exported, "roll and pitch lower the cost"
        run("import", log, "--g2o", solved, "--out", taken)


if __name__ == "__main__":
    main()
