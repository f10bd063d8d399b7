"""Tests when a product is kept or made again, and which values count."""

import argparse
import contextlib
import io
import json
import os
import re
import sys
import tempfile
import time
import unittest
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parent))
from accuracy_lib import anchors  # noqa: E402
from accuracy_lib.metrics import Measured, Sample, Series  # noqa: E402
from accuracy_lib.jobs import OUT, Command, Job, Runner, remarks  # noqa: E402
from accuracy_lib.plan import Plan, RenderJob  # noqa: E402


def shell(text):
    return Command(["/bin/sh", "-c", text])


class RunnerTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.work = Path(folder.name)
        self.source = self.work / "source"
        self.source.write_text("1")

    def chain(self, first=f"cp $PWD/source {OUT}/a", second=f"echo x >>runs; cp first/a {OUT}/b"):
        first, second = (text.replace("$PWD", str(self.work)) for text in (first, second))
        second = second.replace("runs", f"{self.work}/runs").replace("first/", f"{self.work}/first/")
        a = Job("vio", "first", self.work / "first", [shell(first)], main_product="a", outside=[self.source])
        b = Job("server", "second", self.work / "second", [shell(second)], needs=[a], main_product="b")
        return [a, b]

    def run_jobs(self, jobs, **options):
        with contextlib.redirect_stdout(io.StringIO()):
            Runner(jobs, 2, self.work / "logs", **options).run()
        return [job.state for job in jobs]

    def test_what_was_made_is_kept(self):
        self.assertEqual(self.run_jobs(self.chain()), ["done", "done"])
        self.assertEqual(self.run_jobs(self.chain()), ["kept", "kept"])
        self.assertEqual((self.work / "runs").read_text(), "x\n")

    def test_other_input_makes_all_that_reads_it_again(self):
        self.run_jobs(self.chain())
        self.source.write_text("2")
        self.assertEqual(self.run_jobs(self.chain()), ["done", "done"])
        self.assertEqual((self.work / "second/b").read_text(), "2")

    def test_the_same_bytes_made_again_do_not_reach_further(self):
        self.run_jobs(self.chain())
        self.assertEqual(self.run_jobs(self.chain(), redo=["vio"]), ["done", "kept"])

    def test_other_command_makes_it_again(self):
        self.run_jobs(self.chain())
        self.assertEqual(self.run_jobs(self.chain(second=f"cp first/a {OUT}/b")), ["kept", "done"])

    def test_a_failure_leaves_no_product_and_skips_what_needs_it(self):
        self.assertEqual(self.run_jobs(self.chain(first="echo why; false")), ["failed", "skipped"])
        self.assertFalse((self.work / "first").exists())
        self.assertIn("why", (self.work / "logs/vio_first.log").read_text())

    def test_a_missing_program_fails_its_job_alone(self):
        jobs = self.chain()
        jobs.append(Job("vio", "absent", self.work / "absent", [Command(["/nowhere/program"])], main_product="x"))
        self.assertEqual(self.run_jobs(jobs), ["done", "done", "failed"])

    def test_what_failed_and_what_another_build_made_is_told(self):
        program = self.work / "program"
        program.write_text(f'#!/bin/sh\ncp {self.work}/source "$1"/a\n')
        program.chmod(0o755)
        jobs = [Job("vio", "first", self.work / "first", [Command([str(program), OUT])], main_product="a"),
                Job("server", "second", self.work / "second", [shell("false")], main_product="b")]
        self.run_jobs(jobs)
        self.assertEqual(remarks(jobs), ["- failed: server second"])
        program.write_text(program.read_text() + "# changed\n")
        self.assertEqual(remarks(jobs)[0], "- vio: 1 products are of another build of the program (`--redo` makes them again)")

    def test_a_missing_product_fails_the_job(self):
        self.assertEqual(self.run_jobs(self.chain(first="true")), ["failed", "skipped"])


class RenderTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.work = Path(folder.name)
        self.images = self.work / "recording/mav0/cam0/data"
        self.images.mkdir(parents=True)
        (self.images.parent / "data.csv").write_text("#stamp,file\n1,1.png\n2,2.png\n")
        for name in ("1.png", "2.png"):
            (self.images / name).write_text("pixels")
            os.utime(self.images / name, times=(time.time() - 60,) * 2)

    def render(self):
        render = RenderJob("render", "x", self.work / "recording", [shell("render")])
        render.users.append(Job("vio", "x", self.work / "vio", [shell("vio")], needs=[render]))
        return render

    def test_a_whole_recording_rendered_by_hand_is_taken(self):
        self.assertTrue(self.render().fresh())

    def test_half_a_recording_is_not(self):
        (self.images / "2.png").unlink()
        self.assertFalse(self.render().fresh())

    def test_dropped_images_are_rendered_again_only_when_needed(self):
        render = self.render()
        self.assertTrue(render.fresh())
        render.drop_images()
        self.assertFalse(render.fresh())
        vio = render.users[0]
        vio.folder.mkdir()
        (vio.folder / "job.json").write_text(json.dumps({"key": vio.key()}))
        self.assertTrue(render.fresh())
        render.redo = ["vio"]
        self.assertFalse(render.fresh())


class SeriesTest(unittest.TestCase):
    def series(self, *samples):
        return Series("x", {f"seed {i}": sample for i, sample in enumerate(samples, 1)})

    def test_median_and_spread(self):
        cell = self.series(Sample(0.03), Sample(0.01), Sample(0.02))
        self.assertEqual(cell.text(), "0.020 (0.010–0.030)")
        self.assertTrue(cell.at_most(0.02))

    def test_what_does_not_count_is_as_bad_as_can_be(self):
        cell = self.series(Sample(0.01, ["coverage 0.80"]), Sample(0.02), Sample(0.03))
        self.assertEqual(cell.median(), 0.03)
        self.assertEqual(cell.text(), "0.030* (0.010–0.030)")
        self.assertEqual(cell.remarks(), ["x, seed 1: coverage 0.80"])

    def test_too_few_that_count_pass_no_bar(self):
        cell = self.series(Sample(0.01, ["2 maps"]), Sample(None, ["no value"]), Sample(0.02))
        self.assertIsNone(cell.median())
        self.assertFalse(cell.at_most(1))


class MeasuredTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.work = Path(folder.name)
        for sequence in anchors.SEQUENCES:
            (self.work / f"{sequence}_easy.csv").touch()
        self.plan = Plan(argparse.Namespace(bin=".", work=folder.name, seconds=None, only=["table4"], groundtruth=folder.name,
                                            imu=None, real=[], seeds=[1], sequences=["MH_01", "MH_02"], redo=[]))
        self.plan.make()

    def report(self, groups, coverage=1.0):
        job = self.plan.servers["seed1", "MH_01+MH_02"][0]
        job.state = "done"
        agents = [{"id": i, "map_ids": [f"{i}/1"], "ate_vio_m": 0.1, "ate_server_m": 0.05, "coverage": coverage} for i in (1, 2)]
        job.folder.mkdir(parents=True)
        (job.folder / "report.json").write_text(json.dumps({"agents": agents, "groups": groups}))
        return Measured(self.plan)

    def test_fused(self):
        measured = self.report([{"agents": [1, 2], "ate_joint_m": 0.07}])
        self.assertTrue(measured.fused("seed1", "MH_01+MH_02"))
        self.assertEqual(measured.joint("seed1", "MH_01+MH_02"), Sample(0.07))
        self.assertEqual(measured.server("seed1", "MH_01+MH_02", 2), Sample(0.05))

    def test_apart(self):
        measured = self.report([{"agents": [1], "ate_joint_m": 0.05}, {"agents": [2], "ate_joint_m": 0.05}])
        self.assertFalse(measured.fused("seed1", "MH_01+MH_02"))
        self.assertFalse(measured.joint("seed1", "MH_01+MH_02").counts)

    def test_half_covered(self):
        measured = self.report([{"agents": [1, 2], "ate_joint_m": 0.07}], coverage=0.5)
        self.assertTrue(measured.fused("seed1", "MH_01+MH_02"))
        self.assertFalse(measured.joint("seed1", "MH_01+MH_02").counts)
        self.assertEqual(measured.server("seed1", "MH_01+MH_02", 2).reasons, ["coverage 0.50"])

    def test_nothing_made(self):
        measured = Measured(self.plan)
        self.assertEqual(measured.joint("seed1", "MH_01+MH_02"), Sample(None, ["no value"]))
        self.assertEqual(measured.vio("seed1", "MH_01"), Sample(None, ["no value"]))


class PaperTest(unittest.TestCase):
    """The report of a session has no Python but compares with the paper too: its metrics must be the same."""

    SOURCE = Path(__file__).resolve().parents[1] / "modules/report/metrics/report_paper.cc"

    def rows(self, names):
        pattern = r"\{" + r'"(MH_0\d)", ' * names + r"([\d., ]+)\}"
        return [(row[:-1], tuple(map(float, row[-1].split(",")))) for row in re.findall(pattern, self.SOURCE.read_text())]

    def test_single_agents_and_halves(self):
        rows = self.rows(1)
        self.assertEqual([name for (name,), _ in rows], anchors.SEQUENCES)
        for (name,), (alone, server, _, *halves) in rows:
            self.assertEqual((alone, server), (anchors.PAPER_ALONE[name], anchors.PAPER_SERVER[name]))
            self.assertEqual(tuple(halves), anchors.PAPER_HALVES[name])

    def test_pairs(self):
        self.assertEqual(dict(self.rows(2)), anchors.PAPER_PAIRS)


if __name__ == "__main__":
    unittest.main()
