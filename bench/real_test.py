#!/usr/bin/env python3
"""Tests that the known alignment, drift, revisits and wrong constraints are found."""

import argparse
import contextlib
import io
import math
import random
import struct
import sys
import tempfile
import unittest
from pathlib import Path
from unittest import mock

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parent))
from real_lib import colmap, constraints, cycles, funnel, linked_copy, measure, tables, trajectory  # noqa: E402
from real_lib import rotations as rot  # noqa: E402
from real_lib.alignment import centred, largest_eigenvector, rmse  # noqa: E402
from real_lib.plan import Plan  # noqa: E402

Q = rot.normalised((0.5, -0.3, 0.8, 0.1))


def loop(seconds=40, rate=5, period=20):
    """Two rounds, with the camera looking ahead."""
    poses = []
    for i in range(int(seconds * rate)):
        t = i / rate
        a = 2 * math.pi * t / period
        q = rot.multiply((math.cos(a / 2), 0, 0, math.sin(a / 2)), rot.normalised((1, 1, 0.2, 0)))
        poses.append((100 + t, (q, (2 * math.cos(a), math.sin(a), 0.3 * math.sin(3 * a) + 0.01 * t))))
    return poses


def seen(poses, scale=1.0, q=Q, p=(3.0, -1.0, 2.0), late=0.0):
    """The same poses in another frame, with another scale and clock."""
    return [(t + late, rot.compose((q, p), (r, rot.scaled(scale, x)))) for t, (r, x) in poses]


class RotationsTest(unittest.TestCase):
    def test_transforms(self):
        A, B = (Q, (1.0, 2.0, 3.0)), ((math.cos(0.2), math.sin(0.2), 0.0, 0.0), (0.5, 0.0, -1.0))
        back = rot.compose(A, rot.between(A, B))
        self.assertAlmostEqual(math.dist(back[1], B[1]), 0)
        self.assertAlmostEqual(rot.angle(rot.multiply(rot.conjugate(back[0]), B[0])), 0)
        self.assertAlmostEqual(rot.angle(B[0]), 0.4)
        self.assertAlmostEqual(rot.angle(rot.slerp((1.0, 0.0, 0.0, 0.0), B[0], 0.25)), 0.1)

    def test_eigenvector(self):
        rng = random.Random("eigenvector")
        v = rot.normalised([rng.gauss(0, 1) for _ in range(4)])
        matrix = [[3 * v[i] * v[j] + (i == j) for j in range(4)] for i in range(4)]
        self.assertAlmostEqual(abs(sum(a * b for a, b in zip(v, largest_eigenvector(matrix)))), 1, places=9)


class AlignmentTest(unittest.TestCase):
    def test_scale_rotation_and_residuals(self):
        rng = random.Random("alignment")
        points = [tuple(rng.gauss(0, 1) for _ in range(3)) for _ in range(300)]
        noisy = [rot.add(rot.scaled(0.3, rot.rotate(Q, p)), tuple(7 + rng.gauss(0, 0.01) for _ in range(3))) for p in points]
        fit = centred(noisy, points)
        self.assertAlmostEqual(fit.scale(), 0.3, delta=0.002)
        self.assertLess(rot.angle(rot.multiply(rot.conjugate(fit.rotation), Q)), 0.005)
        self.assertAlmostEqual(rmse(fit.squared(fit.scale())), 0.01 * math.sqrt(3), delta=0.001)

    def test_measured_in_a_frame_scale_and_clock_of_its_own(self):
        reference = [trajectory.Piece(loop(), 0)]
        estimate = seen(loop(rate=20), 0.22, late=0.04)
        result = measure.measure(estimate, reference, measure.best_shift(estimate, reference))
        self.assertAlmostEqual(result["scale"], 0.22, places=3)
        self.assertAlmostEqual(result["drift"], 1, places=3)
        self.assertAlmostEqual(result["shift_s"], 0.04)
        self.assertLess(result["ate_m"], 1e-3)
        self.assertGreater(measure.measure(estimate, reference)["ate_m"], 2e-3)
        self.assertAlmostEqual(result["path_m"], 0.22 * trajectory.path_m([p for _, (_, p) in loop()]), delta=0.02)
        self.assertGreater(result["coverage"], 0.95)

    def test_drift_of_scale(self):
        reference = loop()
        estimate = [(t, (q, rot.scaled(1.0 if t < 120 else 1.3, p))) for t, (q, p) in reference]
        self.assertAlmostEqual(measure.measure(estimate, [trajectory.Piece(reference, 0)])["drift"], 1.3, places=2)

    def test_pieces_are_aligned_on_their_own(self):
        reference = loop(60)
        first, last = (trajectory.Piece(poses, 0) for poses in ([x for x in reference if x[0] < 120], [x for x in reference if x[0] > 130]))
        bent = seen(first.poses, 1) + seen(last.poses, 2, (1.0, 0.0, 0.0, 0.0))
        result = measure.measure(bent, [first, last])
        self.assertLess(result["ate_m"], 1e-6)
        self.assertAlmostEqual(result["piece_scales"][0], 1)
        self.assertAlmostEqual(result["piece_scales"][1], 2)
        self.assertAlmostEqual(result["drift"], 2, places=1)

    def test_too_little_is_no_value(self):
        self.assertIsNone(measure.measure(loop(1), [trajectory.Piece(loop(), 0)]))

    def test_half_is_half_covered(self):
        result = measure.measure(loop(20), [trajectory.Piece(loop(40), 0)])
        self.assertAlmostEqual(result["coverage"], 0.5, places=1)


class RevisitsTest(unittest.TestCase):
    def test_a_second_round_is_a_revisit(self):
        pieces = [trajectory.Piece(loop(), 0)]
        exact = measure.measure(seen(loop(), 0.5), pieces)["revisits"]
        self.assertGreaterEqual(exact["pairs"], 40)
        self.assertLess(exact["median_m"], 1e-3)
        drifting = [(t, (q, rot.add(p, (0.02 * (t - 100), 0.0, 0.0)))) for t, (q, p) in loop()]
        found = measure.measure(drifting, pieces)
        self.assertAlmostEqual(found["revisits"]["median_m"], 0.4, delta=0.05)
        self.assertAlmostEqual(found["a_second"]["median_m"], 0.02, delta=0.01)
        self.assertLess(measure.measure(seen(loop(), 0.5), pieces)["a_second"]["median_m"], 1e-3)

    def test_one_round_has_none(self):
        self.assertEqual(measure.measure(loop(15), [trajectory.Piece(loop(15), 0)])["revisits"]["pairs"], 0)

    def test_constraints(self):
        reference = loop()
        pieces = [trajectory.Piece([x for x in reference if x[0] < 115], 0), trajectory.Piece([x for x in reference if x[0] > 121], 0)]
        T_body_cam = (Q, (0.1, 0.0, 0.05))

        def constraint(t, u, off_m=0.0, scale=0.5):
            a, b = (rot.compose(dict(reference)[s], rot.inverse((Q, rot.scaled(1 / scale, T_body_cam[1])))) for s in (t, u))
            q, p = rot.between(a, b)
            covariance = [[0.01 * (i == j) for j in range(6)] for i in range(6)]
            return t, u, (q, rot.add(rot.scaled(scale, p), (scale * off_m, 0.0, 0.0))), covariance

        def check(*given):
            result = measure.check_constraints(given, pieces, 0.5, T_body_cam)
            return result["checked"], result["wrong"], result["revisits"]

        self.assertEqual(check(constraint(101.0, 104.0), constraint(101.0, 113.0, 0.49)), (2, 0, 1))
        nees = measure.check_constraints([constraint(101.0, 104.0, 0.4)], pieces, 0.5, T_body_cam)["nees"]
        self.assertAlmostEqual(nees["mean"], 0.2 ** 2 / 0.01 / 6, places=6)
        self.assertEqual(check(constraint(101.0, 104.0, 0.51)), (1, 1, 0))
        self.assertEqual(check(constraint(101.0, 125.0, 0.9)), (1, 0, 1))  # between pieces
        self.assertEqual(check(constraint(101.0, 125.0, 1.1)), (1, 1, 1))
        pieces[1].frame = 1
        self.assertEqual(check(constraint(101.0, 125.0, 1.1)), (0, 0, 1))


class TrajectoryTest(unittest.TestCase):
    def file(self, text):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        path = Path(folder.name) / "a.tum"
        path.write_text(text)
        return path

    def test_pieces_of_a_file(self):
        a, b = loop(4), [(t + 30, pose) for t, pose in loop(4)]
        holed = trajectory.read_pieces(self.file("# head\n" + trajectory.tum(a + b)))
        self.assertEqual([(p.frame, len(p.poses)) for p in holed], [(0, 20), (0, 20)])
        marked = trajectory.read_pieces(self.file(f"# piece\n{trajectory.tum(a)}\n# piece\n{trajectory.tum(b)}"))
        self.assertEqual(len({p.frame for p in marked}), 2)
        self.assertLess(math.dist(holed[0].poses[3][1][1], a[3][1][1]), 1e-8)

    def test_interpolated_but_not_across_holes(self):
        poses = [(0.0, (Q, (0.0, 0.0, 0.0))), (0.4, (Q, (1.0, 0.0, 0.0))), (2.0, (Q, (2.0, 0.0, 0.0)))]
        stamps = trajectory.stamps_of(poses)
        self.assertAlmostEqual(trajectory.at(poses, stamps, 0.1)[1][0], 0.25)
        self.assertIsNone(trajectory.at(poses, stamps, 1.0))
        self.assertIsNone(trajectory.at(poses, stamps, -0.1))
        self.assertEqual(trajectory.at(poses, stamps, 2.0)[1][0], 2.0)

    def test_keyframes_carry_the_odometry_between_them(self):
        odometry = loop(10, rate=20)
        T = (Q, (1.0, 2.0, 3.0))
        keyframes = [(t, rot.compose(T, pose)) for t, pose in odometry[::10]]
        dense = trajectory.at_camera_rate(keyframes, odometry)
        self.assertEqual(len(dense), 191)  # until the last keyframe
        for t, pose in dense:
            self.assertLess(math.dist(pose[1], rot.compose(T, dict(odometry)[t])[1]), 1e-9)


class FilesTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.work = Path(folder.name)
        self.mav0 = self.work / "house/mav0"
        for sensor, yaml in (("cam0", "rate_hz: 20\nintrinsics: [1, 2, 3, 4]\ndistortion_model: equidistant\n"
                                      "distortion_coefficients: [0, 0, 0, 0.5]\n"),
                             ("imu0", "rate_hz: 200\ngyroscope_noise_density: 1\n")):
            (self.mav0 / sensor).mkdir(parents=True)
            (self.mav0 / sensor / "sensor.yaml").write_text(yaml)
            (self.mav0 / sensor / "data.csv").write_text("#\n1000000000,a.png\n3000000000,b.png\n")

    def plan(self, **given):
        options = {"recording": str(self.mav0.parent), "bin": ".", "work": str(self.work / "out"), "seconds": None, "only": [],
                   "groundtruth": None, "reference": None, "every": 8, "starts": [0.0], "halves": False, "funnel": False, "sensor_yaml": [], "set": []}
        plan = Plan(argparse.Namespace(**{**options, **given}))
        plan.make()
        return plan

    def test_reference_at_hand_goes_before_colmap(self):
        self.assertIn("reference", [job.kind for job in self.plan().jobs])
        (self.mav0.parent / "reference.colmap.tum").write_text("")
        self.assertEqual([job.kind for job in self.plan().jobs], ["vio", "server"])
        truth = self.mav0 / "state_groundtruth_estimate0/data.csv"
        truth.parent.mkdir()
        truth.write_text("")
        self.assertEqual(self.plan().groundtruth(), truth)

    def test_starts_and_halves(self):
        (self.mav0.parent / "reference.colmap.tum").write_text("")
        plan = self.plan(starts=[0.0, 5.0], halves=True)
        self.assertEqual([job.name for job in plan.jobs if job.kind == "server"],
                         ["real from_0s", "real from_5s", "real halves_AB", "real halves_BA"])
        self.assertIn("--duration 1", " ".join(plan.agents["real", "first_half"].vio.commands[0].argv))

    def test_changed_copy(self):
        (self.work / "imu.yaml").write_text("rate_hz: 100\ngyroscope_noise_density: 7\n")
        out = self.work / "copy"
        out.mkdir()
        linked_copy.make(self.mav0, out, [self.work / "imu.yaml"], ["intrinsics=[9, 9, 3, 4]"])
        self.assertIn("intrinsics: [9, 9, 3, 4]\ndist", (out / "cam0/sensor.yaml").read_text())
        self.assertIn("density: 7", (out / "imu0/sensor.yaml").read_text())
        self.assertTrue((out / "cam0/data.csv").samefile(self.mav0 / "cam0/data.csv"))
        self.assertIn("density: 1", (self.mav0 / "imu0/sensor.yaml").read_text())
        with self.assertRaises(SystemExit), contextlib.redirect_stderr(io.StringIO()):
            linked_copy.changed({"cam0": "rate_hz: 1", "imu0": "rate_hz: 2"}, "rate_hz", "5")

    def test_colmap(self):
        self.assertEqual(colmap.camera(self.mav0 / "cam0/sensor.yaml"), ("OPENCV_FISHEYE", "1.0,2.0,3.0,4.0,0.0,0.0,0.0,0.5"))
        self.assertEqual(colmap.chosen(self.mav0, 2, None), {"a.png": 1.0})
        T_ref_cam = (Q, (1.0, 2.0, 3.0))
        q, p = rot.inverse(T_ref_cam)
        text = "# head\n1 " + " ".join(map(str, (*q, *p))) + " 1 a.png\n5 5 -1\n"
        (self.work / "images.txt").write_text(text)
        (stamp, pose), = colmap.read_model(self.work / "images.txt", {"a.png": 1.0})
        self.assertEqual(stamp, 1.0)
        self.assertLess(math.dist(pose[1], T_ref_cam[1]), 1e-9)

    def test_funnel_of_a_log(self):
        def event(channel, data):
            return struct.pack(">IqqII", 0xEDA1DA01, 0, 0, len(channel), len(data)) + channel.encode() + data

        def text(words):
            return struct.pack(">i", len(words) + 1) + words.encode() + b"\0"

        def place_match(query, matches, rejected=()):
            data = struct.pack(">8xiqih", 1, 77, query, len(matches))
            for match in matches:
                data += struct.pack(">iqibfh4h", 1, 77, match, 1, 0.5, 2, 0, 1, 2, 3)
            return event("PLACE_MATCH", data + struct.pack(">h", len(rejected)) + b"".join(map(text, rejected)))

        def constraint(older, newer, good, reason):
            ends = struct.pack(">8xqiqiiqibb", 1, 1, 77, older, 1, 77, newer, 1, good)
            return event("CONSTRAINT", ends + text(reason))

        log = self.work / "session.lcm"
        log.write_bytes(b"".join([
            *(event("KEYFRAME_1", struct.pack(">8xiqiq", 1, 77, k, 10_000_000 * k)) for k in range(6)),
            place_match(3, [0], ["1/77#1: 7 corner matches", "1/77#2: 9 of 30 matches agree on a pose"]),
            place_match(4, [0, 1]), constraint(0, 3, False, "too few inliers"), constraint(0, 4, True, ""),
            constraint(1, 4, False, "too few matched points with a depth")]))
        pairs = [(0.1, 30), (10, 29.9), (20, 30), (0, 40), (10, 40), (0, 50.1), (0, 77)]
        found = funnel.funnel(log, pairs)
        self.assertEqual(found["reached"], {"seen": 6, "retrieved": 5, "matched": 4, "epipolar": 3, "guessed": 2, "accepted": 1})
        self.assertEqual(found["lost"], {"corner matches": 1, "of matches agree on a pose": 1, "too few inliers": 1, "not retrieved": 1,
                                         "too few matched points with a depth": 1})
        self.assertIn("| halves | 6 | 5 | 4 | 3 | 2 | 1 |", funnel.table({"halves": found}))

    def test_images_that_share_points_are_covisible(self):
        images = self.work / "images.txt"
        images.write_text("# list\n1 1 0 0 0 0 0 0 1 a.png\n0 0 5 1 1 6 2 2 -1\n2 1 0 0 0 0 0 0 1 b.png\n0 0 6 1 1 5 2 2 -1 3 3 9\n"
                          "3 1 0 0 0 0 0 0 1 c.png\n0 0 5\n")
        self.assertEqual(list(colmap.covisible(images, {"a.png": 0.0, "b.png": 10.5, "c.png": 9.0})), [(0.0, 10.5, 2)])

    def test_constraints_of_a_log(self):
        def event(channel, data):
            return struct.pack(">IqqII", 0xEDA1DA01, 0, 0, len(channel), len(data)) + channel.encode() + data

        def keyframe(seq, utime):
            return event("KEYFRAME_1", struct.pack(">8xiqiq", 1, 77, seq, utime))

        def constraint(identity, good):
            ends = struct.pack(">8xqiqiiqib?", identity, 1, 77, 0, 1, 77, 1, 1, good)
            return event("CONSTRAINT", ends + struct.pack(">i", 4) + b"why\0" + struct.pack(">43d", 1, 0, 0, 0, 4, 5, 6, *range(36)))

        log = self.work / "session.lcm"
        log.write_bytes(keyframe(0, 2_000_000) + keyframe(1, 15_000_000) + constraint(5, True) + constraint(6, False))
        (found,) = constraints.accepted(log)[(1, 77), (1, 77)]
        self.assertEqual(found[:3], (2.0, 15.0, ((1.0, 0.0, 0.0, 0.0), (4.0, 5.0, 6.0))))
        self.assertEqual([tuple(row) for row in found[3]], [tuple(range(row, row + 6)) for row in range(0, 36, 6)])


class CyclesTest(unittest.TestCase):
    SIGMAS = (0.02, 0.04, 0.01, 0.03, 0.01, 0.05)

    def nees(self, count=400, claimed=1.0, apart_s=1.0):
        """Of pairs of constraints between two odometries, with random errors of SIGMAS."""
        random.seed(1)

        def pose():
            return rot.normalised([random.gauss(0, 1) for _ in range(4)]), tuple(random.gauss(0, 1) for _ in range(3))

        def constraint(A, B):
            error = [random.gauss(0, sigma) for sigma in self.SIGMAS]
            q, p = rot.between(A, B)
            small = rot.normalised((1.0, *(0.5 * x for x in error[3:])))
            return (rot.multiply(small, q), rot.add(p, error[:3]))

        covariance = [[claimed * self.SIGMAS[i] ** 2 * (i == j) for j in range(6)] for i in range(6)]
        values = []
        for _ in range(count):
            poses = {(agent, t): pose() for agent in (1, 2) for t in (0.0, apart_s)}
            found = [(t, t, constraint(poses[1, t], poses[2, t]), covariance) for t in (0.0, apart_s)]
            values += cycles.nees({(1, 2): found}, lambda agent, t, u, poses=poses: rot.between(poses[agent, t], poses[agent, u]))
        return values

    @mock.patch.object(cycles, "DRIFT_M", 0)
    def test_errors_as_large_as_claimed_give_one(self):
        self.assertAlmostEqual(measure.mean_and_median(self.nees())["mean"], 1, delta=0.1)
        self.assertAlmostEqual(measure.mean_and_median(self.nees(claimed=0.25))["mean"], 4, delta=0.6)

    def test_constraints_far_apart_make_no_cycle(self):
        self.assertEqual(self.nees(2, apart_s=2.5), [])
        self.assertEqual(measure.mean_and_median([]), {"number": 0, "mean": None, "median": None})


class TablesTest(unittest.TestCase):
    def test_spread_of_scale(self):
        self.assertAlmostEqual(tables.spread([{"scale": 0.5}, None, {"scale": 2.0}]), 4)
        self.assertIsNone(tables.spread([{"scale": 0.5}, None]))

    def test_no_value_is_said(self):
        self.assertIn("no value", tables.row("odometry", None))


if __name__ == "__main__":
    unittest.main()
