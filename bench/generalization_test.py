#!/usr/bin/env python3
"""Tests that the paths lead where they should, that each fault has the stated effect, and that each pair shares a scene."""

import argparse
import json
import math
import sys
import tempfile
import unittest
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parent))
from ablation_lib.recording import numbers  # noqa: E402
from generalization_lib import paths, people, pictures  # noqa: E402
from generalization_lib.plan import PAIRS, WORLDS, Plan  # noqa: E402
from generalization_lib.spoil import NS, PHONE, SPOILERS, Recording  # noqa: E402
from generalization_lib.tables import Tables  # noqa: E402

CAMERA = "T_BS:\n  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\nintrinsics: [400, 410, 320, 240]\n"
IMU = "rate_hz: 200\ngyroscope_noise_density: 1e-4\ngyroscope_random_walk: 1e-5\n" \
      "accelerometer_noise_density: 2e-3\naccelerometer_random_walk: 3e-3\n"


class WaysTest(unittest.TestCase):
    def poses(self, name, seconds):
        return [[float(x) for x in line.split()] for line in paths.tum(paths.WAYS[name], seconds).splitlines()]

    def rotation(self, a, b):
        return 2 * math.acos(min(1, abs(sum(x * y for x, y in zip(a[4:], b[4:])))))

    def test_stands_where_it_should(self):
        poses = self.poses("stands", 45)
        for begin, end in ((10, 17), (27, 40)):
            rest = [p for p in poses if begin <= p[0] - 1000 <= end]
            self.assertLess(max(math.dist(p[1:4], rest[0][1:4]) for p in rest), 1e-6)
            self.assertLess(max(self.rotation(p, rest[0]) for p in rest), 1e-4)  # the rounding error of nine digits
        self.assertGreater(math.dist(poses[0][1:4], poses[200][1:4]), 1)

    def test_turns_twice_on_the_spot(self):
        spot = [p for p in self.poses("turns", 30) if 11 <= p[0] - 1000 <= 26]
        self.assertLess(max(math.dist(p[1:4], spot[0][1:4]) for p in spot), 0.2)
        self.assertAlmostEqual(sum(self.rotation(a, b) for a, b in zip(spot, spot[1:])), 4 * math.pi, delta=0.5)

    def test_drives_at_5_m_per_s(self):
        poses = self.poses("drives", 12)
        self.assertAlmostEqual(math.dist(poses[-1][1:4], poses[-1 - paths.RATE_HZ][1:4]), 5, delta=0.1)

    def test_the_camera_looks_ahead(self):
        R, p = paths.body_pose((1, 2, 3), math.pi / 2, 0, 0)
        ahead = [sum(R[i][k] * paths.R_BODY_CAM[k][2] for k in range(3)) for i in range(3)]
        camera = [x + sum(R[i][k] * paths.P_BODY_CAM[k] for k in range(3)) for i, x in enumerate(p)]
        for a, b in zip(ahead + camera, (0, 1, 0, 1, 2, 3)):
            self.assertAlmostEqual(a, b, places=9)

    def test_quaternions(self):
        for angle in (0, 1, 2, 3, -3):
            c, s = math.cos(angle), math.sin(angle)
            for R, axis in (([[1, 0, 0], [0, c, -s], [0, s, c]], 0), ([[c, 0, s], [0, 1, 0], [-s, 0, c]], 1),
                            ([[c, -s, 0], [s, c, 0], [0, 0, 1]], 2)):
                expected = [math.sin(angle / 2) if i == axis else 0 for i in range(3)] + [math.cos(angle / 2)]
                self.assertAlmostEqual(abs(sum(a * b for a, b in zip(paths.quaternion(R), expected))), 1, places=9)


class SpoilTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.mav0 = Path(folder.name) / "mav0"
        for name, yaml, step, columns, count in (("cam0", CAMERA, 50_000_000, ["x.png"], 400),
                                                 ("imu0", IMU, 5_000_000, 6 * ["0.0"], 4000)):
            (self.mav0 / name).mkdir(parents=True)
            (self.mav0 / name / "sensor.yaml").write_text(yaml)
            rows = [",".join([str(NS + step * i), *columns]).replace("x.png", f"{i}.png") for i in range(count)]
            (self.mav0 / name / "data.csv").write_text("#stamp\n" + "\n".join(rows) + "\n")

    def spoiled(self, what):
        recording = Recording(self.mav0)
        SPOILERS[what](recording)
        out = self.mav0.parent / what
        recording.write(out)
        return Recording(out)

    def longest_gap_s(self, rows):
        stamps = [int(row[0]) for row in rows]
        return max(b - a for a, b in zip(stamps, stamps[1:])) / NS

    def test_gaps(self):
        self.assertAlmostEqual(self.longest_gap_s(self.spoiled("image_gaps").images), 0.35)
        self.assertAlmostEqual(self.longest_gap_s(self.spoiled("imu_gaps").imu), 0.055)
        self.assertAlmostEqual(len(self.spoiled("lone_images").images), 360, delta=20)
        self.assertAlmostEqual(self.longest_gap_s(self.spoiled("half_rate").images), 0.1)

    def test_a_covered_lens_and_exposure(self):
        covered, steps = Recording(self.mav0), Recording(self.mav0)
        rows = covered.images
        for i, row in enumerate(rows):
            row[1] = f"{i}.png"
        steps.images = rows
        SPOILERS["covered"](covered)
        SPOILERS["exposure_steps"](steps)
        self.assertEqual(set(covered.painted), {f"{i}.png" for i in range(200, 220)})
        dark = covered.painted["200.png"](bytes(range(200)))
        self.assertEqual(len(dark), 200)
        self.assertLess(max(dark), 20)
        self.assertNotIn("0.png", steps.painted)
        self.assertEqual(steps.painted["60.png"](bytes([100, 250])), bytes([40, 100]))
        self.assertEqual(steps.painted["120.png"](bytes([100, 250])), bytes([180, 255]))

    def test_a_stationary_start(self):
        recording = Recording(self.mav0)
        recording.imu = [[row[0], "0.01", "0", "0", "0", "0", "9.0"] for row in recording.imu]
        images, imu = list(recording.images), list(recording.imu)
        recording.imu.insert(0, [str(int(imu[0][0]) - NS // 300), *imu[0][1:]])  # before the first image it moves already
        SPOILERS["rest"](recording)
        self.assertEqual((recording.images[200:], recording.imu[2000:]), (images, imu))
        for rows, step in ((recording.images, NS // 20), (recording.imu, NS // 200)):
            self.assertEqual({int(b[0]) - int(a[0]) for a, b in zip(rows, rows[1:])}, {step})
        self.assertEqual({recording.origins[row[1]] for row in recording.images[:200]}, {images[0][1]})
        a, b = (recording.painted[row[1]](bytes([100] * 500)) for row in recording.images[:2])
        self.assertAlmostEqual(math.dist(a, b) / math.sqrt(500), 2 * math.sqrt(2), delta=0.4)
        forces = [float(row[6]) for row in recording.imu[:2000]]
        self.assertAlmostEqual(sum(forces) / 2000, 9.81, places=2)
        self.assertAlmostEqual(math.dist(forces, 2000 * [9.81]) / math.sqrt(2000), 2e-3 * math.sqrt(200), delta=2e-3)
        self.assertAlmostEqual(sum(float(row[1]) for row in recording.imu[:2000]) / 2000, 0.01, places=3)

    def test_people_walk_past_the_true_camera(self):
        # The camera looks along x, first from the origin, then from 1 m further on.
        yaml = "T_BS:\n  data: [0, 0, 1, 0, -1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 0, 1]\nresolution: [640, 480]\n" \
               "intrinsics: [400, 400, 320, 240]\ndistortion_coefficients: [0, 0, 0, 0]\n"
        (self.mav0 / "cam0/sensor.yaml").write_text(yaml)
        truth = self.mav0 / "state_groundtruth_estimate0"
        truth.mkdir()
        (truth / "data.csv").write_text("".join(f"{NS + NS // 20 * i},{int(i >= 230)},0,0,1,0,0,0\n" for i in range(400)))
        view = people.View(Recording(self.mav0))
        one = people.Passage(9, 12, [people.Person(3.0, 0.0, [[7] * people.COLUMNS] * people.ROWS)])
        x0, x1, y0, y1 = next(view.rectangles(one, 10.5))[0]
        for value, expected in ((x0 + x1, 640), (x1 - x0, 400 * people.WIDTH_M / 3), (y1, 240 + 400 * people.EYES_M / 3),
                                (y1 - y0, 400 * people.HEIGHT_M / 3)):
            self.assertAlmostEqual(value, expected, places=3)
        x2, x3, *_ = next(view.rectangles(one, 11.75))[0]  # 1.5 m to the right, and 1 m nearer
        self.assertAlmostEqual(x2 + x3, 640 + 2 * 400 * 1.5 / 2, places=3)
        pixels = people.painted(bytes(640 * 480), view.camera, [((-10.0, 2.0, 470.0, 900.0), one.people[0].clothes)])
        self.assertEqual([i for i, grey in enumerate(pixels) if grey], [640 * y + x for y in range(470, 480) for x in (0, 1)])

    def test_images_that_stay_are_links(self):
        folder = self.mav0.parent / "images"
        folder.mkdir()
        for name in ("a.png", "b.png"):
            pictures.write(folder / name, 3, bytes(range(6)))
        recording = Recording(self.mav0)
        recording.images = [["0", "a.png"], ["1", "b.png"]]
        recording.painted = {"b.png": lambda pixels: pixels[::-1]}
        recording.write_images(folder, self.mav0.parent / "painted")
        self.assertTrue((self.mav0.parent / "painted/a.png").is_symlink())
        self.assertEqual(pictures.read(self.mav0.parent / "painted/b.png"), (3, bytes([5, 4, 3, 2, 1, 0])))

    def test_rows_of_a_png_are_unfiltered(self):
        row, above = bytes([10, 20, 250]), bytes([1, 2, 3])
        for kind, stored in ((0, [10, 20, 250]), (1, [10, 10, 230]), (2, [9, 18, 247]), (3, [10, 14, 239]), (4, [9, 10, 230])):
            self.assertEqual(pictures.unfiltered(kind, bytes(stored), above), row, kind)

    def test_disorder_loses_nothing(self):
        spoiled, exact = self.spoiled("disorder"), Recording(self.mav0)
        for rows, before in ((spoiled.images, exact.images), (spoiled.imu, exact.imu)):
            stamps = [int(row[0]) for row in rows]
            self.assertNotEqual(sorted(stamps), stamps)
            self.assertGreater(len(rows), len(before))
            self.assertEqual(sorted(set(stamps)), [int(row[0]) for row in before])

    def test_repeated_images(self):
        before, at_60_hz = Recording(self.mav0), self.spoiled("copies_at_60_hz")
        self.assertEqual([row[1] for row in at_60_hz.images[::3]], [row[1] for row in before.images])
        self.assertEqual(int(at_60_hz.images[1][0]) - int(at_60_hz.images[0][0]), NS // 60)
        for what, times in (("repeated_images", 0.2), ("shown_too_early", 0.5)):
            names = [row[1] for row in self.spoiled(what).images]
            self.assertAlmostEqual(sum(a == b for a, b in zip(names, names[1:])), times * len(names), delta=25)

    def test_calibration(self):
        self.assertEqual(numbers(self.spoiled("focal_length").camera_yaml, "intrinsics"), [402, 412.05, 320, 240])
        matrix = numbers(self.spoiled("extrinsics").camera_yaml, "data")
        self.assertAlmostEqual(math.degrees(math.acos((matrix[0] + matrix[5] + matrix[10] - 1) / 2)), 0.5, places=6)

    def test_a_wrong_direction_is_its_own_inverse(self):
        before = Recording(self.mav0)
        for what in ("negated_accel", "negated_gyro", "swapped_accel", "inverse_extrinsics"):
            twice = Recording(self.mav0)
            twice.imu = [[row[0], "1.0", "2.0", "3.0", "4.0", "5.0", "6.0"] for row in twice.imu]
            twice.camera_yaml = before.camera_yaml.replace("[1, 0, 0, 0, 0, 1, 0, 0,", "[0, -1, 0, 0.5, 1, 0, 0, 0.25,")
            imu, yaml = [float(value) for value in twice.imu[0][1:]], numbers(twice.camera_yaml, "data")
            SPOILERS[what](twice)
            once = [float(value) for value in twice.imu[0][1:]], numbers(twice.camera_yaml, "data")
            self.assertNotEqual(once, (imu, yaml), what)
            SPOILERS[what](twice)
            self.assertEqual(([float(value) for value in twice.imu[0][1:]], numbers(twice.camera_yaml, "data")), (imu, yaml), what)

    def test_wrong_axes_and_units(self):
        self.assertEqual(numbers(self.spoiled("turned_camera").camera_yaml, "data")[:8], [0, -1, 0, 0, 1, 0, 0, 0])
        self.assertEqual(numbers(self.spoiled("backward_camera").camera_yaml, "data")[:12], [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0])
        self.assertEqual(numbers(self.spoiled("long_focal_length").camera_yaml, "intrinsics"), [560, 574, 320, 240])
        self.assertEqual(numbers(self.spoiled("short_focal_length").camera_yaml, "intrinsics"), [280, 287, 320, 240])

    def test_clocks(self):
        before, late = Recording(self.mav0), self.spoiled("late_images")
        self.assertEqual(int(late.imu[7][0]) - int(before.imu[7][0]), 40_000_000)
        self.assertEqual(late.images, before.images)
        off = [int(a[0]) - int(b[0]) for a, b in zip(self.spoiled("jitter").images, before.images)]
        self.assertAlmostEqual(math.hypot(*off) / math.sqrt(len(off)), 2e6, delta=3e5)

    def test_imu(self):
        self.assertEqual([row[4] for row in self.spoiled("accel_bias").imu[:2]], ["0.3000000000"] * 2)
        phone = self.spoiled("phone_imu")
        self.assertEqual(numbers(phone.imu_yaml, "rate_hz"), 100)
        column = [float(row[4]) for row in phone.imu]
        self.assertEqual(len(column), 2000)
        jumps = [b - a for a, b in zip(column, column[1:])]  # white noise: their sigma is sqrt(2) times that of the samples
        expected = PHONE["accelerometer_noise_density"] * math.sqrt(2 * 100)
        self.assertAlmostEqual(math.hypot(*jumps) / math.sqrt(len(jumps)), expected, delta=0.1 * expected)
        self.assertEqual(numbers(phone.imu_yaml, "accelerometer_noise_density"), PHONE["accelerometer_noise_density"])


class PlanTest(unittest.TestCase):
    def plan(self, *worlds):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        for sequence in ("MH_02", "MH_03", "V1_03"):
            (Path(folder.name) / f"{sequence}_x.csv").touch()
        plan = Plan(argparse.Namespace(bin=".", work=folder.name, groundtruth=folder.name, worlds=list(worlds), seconds=None,
                                       only=[], drop_images=False))
        plan.make()
        return plan

    def test_names_and_sources(self):
        names = [world.name for world in WORLDS]
        self.assertEqual(len(set(names)), len(names))
        for world in WORLDS:
            self.assertTrue(world.scene or (world.source in names and world.spoiled), world.name)
            self.assertTrue(set(world.spoiled) <= set(SPOILERS), world.name)

    def test_a_pair_shares_a_scene(self):
        scene = {world.name: world.scene for world in WORLDS}
        scene |= {world.name: scene[world.source] for world in WORLDS if world.source}
        for a, b in PAIRS:
            self.assertEqual(scene[a], scene[b])

    def test_a_source_is_rendered_once(self):
        plan = self.plan("flight", "disorder", "extrinsics")
        self.assertEqual([job.name for job in plan.jobs if job.kind == "render"], ["flight"])
        self.assertEqual([job.name for job in plan.jobs if job.kind == "recording"], ["disorder", "extrinsics"])

    def test_an_euroc_path_keeps_its_neighbour_clear(self):
        renders = {job.name: job.commands[0].argv for job in self.plan("mh02", "mh03").jobs if job.kind == "render"}
        clear = [argv[argv.index("--keep-clear") + 1:argv.index("--start")] for argv in renders.values()]
        self.assertEqual(clear[0], clear[1])
        self.assertEqual([Path(file).name for file in clear[0]], ["MH_02_x.csv", "MH_03_x.csv"])

    def test_rows(self):
        plan = self.plan("flight", "phone")
        flight = plan.agents[plan.WHERE, "flight"]
        truth = flight.recording / "mav0/state_groundtruth_estimate0"
        truth.mkdir(parents=True)
        (truth / "data.csv").write_text("#\n" + "".join(f"{i},{0.1 * i},0,0,1,0,0,0\n" for i in range(101)))
        flight.vio.folder.mkdir(parents=True)
        (flight.vio.folder / "vio.tum").touch()
        own = {"ate_m": {"rmse": 0.02}, "trajectories": [{"ate_m": {"rmse": 0.02}, "coverage": 0.9}]}
        (flight.vio.folder / "ate.json").write_text(json.dumps({"SE(3)": own, "Sim(3)": {"ate_m": {"rmse": 0.015}}}))
        text = Tables(plan).text()
        self.assertIn("| flight | a drone's flight | 10 | 1 | 0.90\\* | 0.020 | 0.015 | 0.20% |", text)
        self.assertIn("its IMU at 100 Hz | – | 0 | – | – | – | – |", text)
        self.assertIn("| flight+phone | no value |", text)


if __name__ == "__main__":
    unittest.main()
