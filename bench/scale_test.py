"""Tests the table of cities, with artificial runs."""

import sys
import unittest
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parent))
from scale_lib.tables import is_good, ratios, table  # noqa: E402


def run(keyframes, ms, fused_after=3, ready_s=1.0, accepted=10, ate_m=0.02, recognition_alone=False):
    agent = {"hall": 0, "model": -1, "accepted": accepted, "refused": accepted // 5, "wrong": 1, "fused_after": fused_after,
             "other_halls": 0, "joint_ate_m": ate_m}
    return {"keyframes": keyframes, "halls": 4, "longest_solve_ms": 5.0, "agents": [agent, agent], "recognition_alone": recognition_alone,
            "processes": {"fusion": {"ms_a_keyframe": ms, "kept_kb_a_keyframe": 0.2}},
            "starts": [{"fusion": {"ready_s": ready_s, "cpu_s": 2.0, "memory_mb": 3}}]}


class ScaleTest(unittest.TestCase):
    def test_each_size_is_compared_with_the_one_before(self):
        self.assertEqual(ratios([2.0, 3.0, 6.0]), "1.50, 2.00")
        self.assertEqual(ratios([None, 3.0, None]), "–, –")
        lines = table([run(1008, 20.0), run(10080, 25.0)]).splitlines()
        self.assertIn("| fusion, CPU ms a new keyframe | 20.0 | 25.0 | 1.25 |", lines)
        self.assertIn("| wrong constraints | 2 of 20 | 2 of 20 |  |", lines)
        self.assertFalse(any("map_points" in line for line in lines), "nothing was measured of it")

    def test_an_agent_alone_or_a_server_that_is_not_ready_is_not_good(self):
        self.assertTrue(is_good(run(1008, 20.0)))
        self.assertFalse(is_good(run(1008, 20.0, fused_after=-1)))
        self.assertFalse(is_good(run(1008, 20.0, ready_s=None)))

    def test_an_agent_that_was_never_recognised_is_not_good(self):
        alone = {"fused_after": -1, "accepted": 0, "ate_m": -1}
        self.assertFalse(is_good(run(1008, 20.0, **alone)))
        self.assertTrue(is_good(run(1008, 20.0, recognition_alone=True, **alone)))
        self.assertIn("| joint ATE, mm, worst hall | – | 20.0 | – |", table([run(1008, 20.0, **alone), run(1008, 20.0)]))


if __name__ == "__main__":
    unittest.main()
