#!/usr/bin/env python3
"""Tests the effect of each rung, its size, and the jobs that it needs."""

import argparse
import json
import math
import statistics
import sys
import tempfile
import unittest
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parent))
from ablation_lib.plan import Plan  # noqa: E402
from ablation_lib.recording import (FOCAL_OFF, ROTATION_OFF, TRANSLATION_OFF, numbers, worse_calibration,  # noqa: E402
                                    worse_imu)
from ablation_lib.rungs import ALONE, LADDER, RECORDED, Given  # noqa: E402
from ablation_lib.tables import Tables  # noqa: E402
from accuracy_lib.anchors import SEQUENCES  # noqa: E402

IMU = """rate_hz: 200
gyroscope_noise_density: 1.0e-3     # [ rad / s / sqrt(Hz) ]
gyroscope_random_walk: 1.0e-5
accelerometer_noise_density: 2.0e-2
accelerometer_random_walk: 3.0e-3
"""
CAMERA = """T_BS:
  cols: 4
  rows: 4
  data: [0.0, -1.0, 0.0, 0.1,
         1.0, 0.0, 0.0, 0.2,
         0.0, 0.0, 1.0, 0.3,
         0.0, 0.0, 0.0, 1.0]
rate_hz: 20
intrinsics: [400, 410, 320, 240] #fu, fv, cu, cv
"""


class RungsTest(unittest.TestCase):
    def test_each_rung_takes_one_more_thing_away(self):
        self.assertEqual(LADDER[0].given, Given())
        for above, rung in zip(LADDER, LADDER[1:]):
            changed = [name for name, value in vars(rung.given).items() if value != vars(above.given)[name]]
            self.assertEqual(len(changed), 1, rung.name)
        for rung in ALONE:
            changed = [name for name, value in vars(rung.given).items() if value != vars(Given())[name]]
            self.assertEqual(len(changed), 1, rung.name)

    def test_draws_nothing_where_nothing_is_random(self):
        self.assertEqual([rung.name for rung in LADDER if not rung.given.seeded], ["exact", "tracker"])
        self.assertTrue(RECORDED.given.seeded)


class WorseImuTest(unittest.TestCase):
    ROWS = [[str(5_000_000 * i), *6 * [0.0]] for i in range(4000)]

    def column(self, noise, bias, i, seed=1):
        return [row[1 + i] for row in worse_imu(self.ROWS, IMU, noise, bias, seed)]

    def test_exact_stays_exact(self):
        self.assertEqual(worse_imu(self.ROWS, IMU, False, False, 1), self.ROWS)

    def test_noise_has_the_density_of_the_sheet(self):
        for i, density in ((0, 1e-3), (5, 2e-2)):
            column = self.column(True, False, i)
            self.assertAlmostEqual(statistics.pstdev(column), density * math.sqrt(200), delta=0.05 * density * math.sqrt(200))
            self.assertLess(abs(statistics.mean(column)), 4 * density * math.sqrt(200 / len(column)))

    def test_a_bias_walks_slowly_and_is_the_same_with_noise(self):
        bias, both, noise = self.column(False, True, 5), self.column(True, True, 5), self.column(True, False, 5)
        self.assertLess(max(abs(b - a) for a, b in zip(bias, bias[1:])), 5 * 3e-3 / math.sqrt(200))
        self.assertNotEqual(bias[0], self.column(False, True, 5, seed=2)[0])
        for a, b, c in zip(bias, both, noise):
            self.assertAlmostEqual(a + c, b, places=12)


class WorseCalibrationTest(unittest.TestCase):
    def test_exact_stays_exact(self):
        self.assertEqual(worse_calibration(CAMERA, [], 1), CAMERA)

    def test_a_field_that_is_missing_is_named(self):
        with self.assertRaisesRegex(SystemExit, "lacks the field 'intrinsics'"):
            numbers("cam0:\n  T_cam_imu: 1\n", "intrinsics")

    def test_extrinsics_are_off_by_so_much(self):
        for seed in (1, 2, 3):
            before, after = numbers(CAMERA, "data"), numbers(worse_calibration(CAMERA, ["extrinsics"], seed), "data")
            trace = sum(before[4 * i + k] * after[4 * i + k] for i in range(3) for k in range(3))
            self.assertAlmostEqual(math.acos((trace - 1) / 2), ROTATION_OFF, places=6)
            self.assertAlmostEqual(math.dist(before[3:12:4], after[3:12:4]), TRANSLATION_OFF, places=12)

    def test_intrinsics_and_time_offset(self):
        text = worse_calibration(CAMERA, ["intrinsics", "time_offset"], 1)
        fx, fy, cx, cy = numbers(text, "intrinsics")
        self.assertAlmostEqual(abs(fx / 400 - 1), FOCAL_OFF, places=12)
        self.assertAlmostEqual(fy / 410, fx / 400, places=12)
        self.assertEqual((abs(cx - 320), abs(cy - 240)), (1, 1))
        self.assertEqual(abs(numbers(text, "time_offset_s")), 0.005)
        self.assertEqual(numbers(text, "data"), numbers(CAMERA, "data"))


class PlanTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.work = Path(folder.name)
        for sequence in SEQUENCES:
            (self.work / f"{sequence}_easy.csv").touch()
        self.plan = Plan(argparse.Namespace(bin=".", work=folder.name, groundtruth=folder.name, imu=None, seeds=[1, 2],
                                            scenes=["MH_01", "walk"], threads=1))
        self.jobs = self.plan.make()

    def test_renders_no_images_twice(self):
        renders = [job.name for job in self.jobs if job.kind == "render"]
        self.assertEqual(renders, [f"{scene} {images}" for scene in ("MH_01", "walk")
                                   for images in ("perfect 1", "noisy 1", "noisy 2", "full 1", "full 2")])
        self.assertEqual(len({job.folder for job in self.jobs}), len(self.jobs))

    def test_every_rung_is_run_on_every_seed(self):
        for scene in ("MH_01", "walk"):
            self.assertEqual(len(self.plan.runs[scene, "exact"]), 1)
            for rung in (*LADDER[2:], *ALONE):
                self.assertEqual(list(self.plan.runs[scene, rung.name]), [1, 2], rung.name)

    def test_exact_tracks_only_where_they_are_given(self):
        for rung in (*LADDER, *ALONE):
            argv = self.plan.runs["walk", rung.name][1].commands[0].argv
            self.assertEqual("--tracks" in argv, rung.given.tracks == "exact", rung.name)

    def test_table(self):
        for seed, ate in ((1, 0.010), (2, 0.030)):
            job = self.plan.runs["walk", "blur"][seed]
            job.state = "done"
            job.folder.mkdir(parents=True)
            (job.folder / "vio.tum").touch()
            own = {"ate_m": {"rmse": ate, "median": 0.008}, "coverage": 1.0 if seed == 1 else 0.5}
            (job.folder / "ate.json").write_text(json.dumps({"SE(3)": {"trajectories": [own]}}))
            row = {"position_m": {"rmse": 0.002}, "rotation_deg": {"rmse": 0.05}}
            (job.folder / "rpe.json").write_text(json.dumps({"over_distance": [row]}))
        line = next(line for line in Tables(self.plan).text().splitlines() if line.startswith("| + motion blur"))
        self.assertEqual(line, "| + motion blur | – | – | 20.0 (10.0–30.0)\\*, 8.0 (8.0–8.0) | 2.0 (2.0–2.0), 0.050 (0.050–0.050) |")


if __name__ == "__main__":
    unittest.main()
