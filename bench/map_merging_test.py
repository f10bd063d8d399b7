#!/usr/bin/env python3
"""Tests that paths lead where they should, that sessions which should fuse share a scene, and that a row reports the bounds that it misses."""

import argparse
import json
import math
import sys
import tempfile
import unittest
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parent))
from map_merging_lib import ways  # noqa: E402
from map_merging_lib.plan import Plan  # noqa: E402
from map_merging_lib.tables import Row, Tables  # noqa: E402
from map_merging_lib.worlds import SESSIONS, NEVER, WORLDS, Session  # noqa: E402
from generalization_lib.paths import RATE_HZ, body_pose  # noqa: E402

SQUARE = ((0, 0), (10, 0), (10, 10), (0, 10), (0, 0))


class WaysTest(unittest.TestCase):
    def test_corners_are_followed_and_rounded(self):
        self.assertEqual(ways.along(SQUARE, 13), (10, 3))
        self.assertEqual(ways.along(SQUARE, 43), ways.along(SQUARE, 3))
        self.assertEqual(ways.along(SQUARE[:2], 12), (12, 0))  # straight on
        self.assertEqual(ways.along(SQUARE[:2], -2), (-2, 0))
        self.assertAlmostEqual(math.dist(ways.rounded(SQUARE, 5), (5, 0)), 0, places=9)
        self.assertGreater(math.dist(ways.rounded(SQUARE, 10), (10, 0)), 0.2)

    def test_nobody_jerks(self):
        for world in WORLDS:
            places = [ways.camera(world.way, i / RATE_HZ)[0] for i in range(int(RATE_HZ * world.seconds))]
            steps = [[b - a for a, b in zip(p, q)] for p, q in zip(places, places[1:])]
            speed = sum(math.hypot(*step) for step in steps) / world.seconds
            self.assertAlmostEqual(speed, world.way.speed, delta=0.25 * world.way.speed, msg=world.name)
            hardest = max(math.dist(a, b) for a, b in zip(steps, steps[1:])) * RATE_HZ ** 2
            self.assertLess(hardest, 15, world.name)  # with an unrounded corner: 70

    def test_every_lens_looks_ahead(self):
        for lens, (R_body_cam, _) in ways.EXTRINSICS.items():
            R, _ = body_pose((0, 0, 0), math.pi / 2, 0, 0, ways.EXTRINSICS[lens])
            ahead = [sum(R[i][k] * R_body_cam[k][2] for k in range(3)) for i in range(3)]
            for a, b in zip(ahead, (0, 1, 0)):
                self.assertAlmostEqual(a, b, places=9)

    def test_looks_to_the_left(self):
        yaws = [ways.camera(ways.Way(((0, 0), (90, 0)), looks=looks), 3)[1] for looks in (0, 90)]
        self.assertAlmostEqual(yaws[1] - yaws[0], math.pi / 2)


class PlanTest(unittest.TestCase):
    def plan(self, *sessions):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        plan = Plan(argparse.Namespace(bin=".", work=folder.name, groundtruth=None, sessions=list(sessions), seconds=None, only=[]))
        plan.make()
        return plan

    def test_only_who_shares_a_scene_may_meet(self):
        scenes = {world.name: world.scene for world in WORLDS}
        self.assertEqual(len(scenes), len(WORLDS))
        for session in SESSIONS:
            self.assertEqual(len({scenes[name] for name in session.names}) == 1, session.fuse != NEVER, session.name)

    def test_recordings_of_a_scene_are_built_around_the_same_ways(self):
        renders = [job for job in self.plan("bare_walk+bare_phone").jobs if job.kind == "render"]
        clear = [argv[argv.index("--keep-clear") + 1:argv.index("--duration")] for argv in (r.commands[0].argv for r in renders)]
        self.assertEqual(len(clear), 2)
        self.assertEqual(clear[0], clear[1])
        self.assertEqual(renders[0].files, renders[1].files)
        self.assertEqual({Path(file).name for file in clear[0]}, set(renders[0].files))

    def test_both_orders_and_each_alone(self):
        plan = self.plan("bare_walk+bare_phone")
        servers = {job.name.split(" ", 1)[1]: job for job in plan.jobs if job.kind == "server"}
        self.assertEqual(set(servers), {"bare_walk", "bare_phone", "bare_walk+bare_phone", "bare_walk+bare_phone back"})
        logs = [[Path(word).parent.name for word in servers[name].commands[0].argv if word.endswith("keyframes.lcm")]
                for name in ("bare_walk+bare_phone", "bare_walk+bare_phone back")]
        self.assertEqual(logs[0], logs[1][::-1])


class TablesTest(unittest.TestCase):
    def row(self, fuse="yes", **values):
        good = {"alone": [0.02, 0.02], "fused": [0.015, 0.02], "joint": [0.02, 0.021], "apart": False, "constraints": 40, "nees": 1.0}
        return Row(Session(("a", "b"), "", fuse), **{**good, **values})

    def test_a_row_tells_what_it_misses(self):
        self.assertEqual(self.row().missed(), [])
        self.assertEqual(self.row(apart=True, joint=[None, None], constraints=0, nees=None).missed(), ["apart"])
        self.assertEqual(self.row("may", apart=True, joint=[None, None], constraints=0, nees=None).missed(), [])
        self.assertEqual(self.row(wrong=2).missed(), ["2 wrong"])
        self.assertEqual(self.row(nees=2.1).missed(), ["NEES"])
        self.assertEqual(self.row(nees=0.4).missed(), ["NEES"])
        self.assertEqual(self.row(nees=5, constraints=9).missed(), [])
        self.assertEqual(self.row(fused=[0.026, 0.02]).missed(), ["worse than alone"])
        self.assertEqual(self.row(joint=[0.02, 0.026]).missed(), ["order"])
        self.assertEqual(self.row(joint=[0.02, None]).missed(), ["order decides"])
        self.assertEqual(self.row(NEVER, constraints=3).missed(), ["3 constraints"])
        self.assertEqual(self.row(NEVER, constraints=0, apart=True, joint=[None, None]).missed(), [])

    def tables(self, session, of_order):
        """`of_order`: constraints between the recordings, and wrong ones, by the end of the server job's name."""
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        options = argparse.Namespace(bin=".", work=folder.name, groundtruth=None, sessions=[session], seconds=None, only=[])
        plan = Plan(options)
        plan.make()
        for (_, name), (job, agents) in plan.servers.items():
            checked, wrong = of_order.get(name.removeprefix(session), (0, 0)) if "+" in name else (0, 0)
            constraints = {"checked": checked, "wrong": 0, "nees_per_dim": {"mean": 1.5}} if checked else None
            report = {"agents": [{"id": a.id, "ate_vio_m": 0.03, "ate_server_m": 0.01, "coverage": 1, "map_ids": [1]} for a in agents],
                      "groups": [{"agents": sorted(a.id for a in agents), "ate_joint_m": 0.02}],
                      "constraints_truth": {"wrong": wrong, "inter": constraints, "intra": None}}
            job.folder.mkdir(parents=True)
            (job.folder / "report.json").write_text(json.dumps(report))
            job.state = "kept"
        return Tables(plan)

    def test_a_row_from_reports(self):
        tables = self.tables("bare_walk+bare_phone", {"": (12, 1), " back": (11, 0)})
        self.assertEqual(tables.missed(), ["bare_walk+bare_phone: 1 wrong"])
        self.assertIn("| yes | yes | 0.020 / 0.020 | 0.010, 0.010 | 0.010, 0.010 | 12, 1 | 1.50 | 1 wrong |", tables.text())

    def test_the_other_order_counts_too(self):
        self.assertEqual(self.tables("bare_walk+bare_phone", {"": (12, 0), " back": (11, 2)}).missed(), ["bare_walk+bare_phone: 2 wrong"])
        self.assertEqual(self.tables("plant_walk+yard_west", {" back": (3, 3)}).missed(), ["plant_walk+yard_west: 3 constraints"])


if __name__ == "__main__":
    unittest.main()
