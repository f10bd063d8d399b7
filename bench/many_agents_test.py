"""Tests the evaluation of a run of many agents, with artificial logs."""

import struct
import sys
import tempfile
import unittest
from argparse import Namespace
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parent))
from link_lib.metrics import keyframes  # noqa: E402
from link_test import write_log  # noqa: E402
from many_agents_lib.metrics import metrics, table  # noqa: E402
from many_agents_lib.run import copy_for  # noqa: E402


def join(logs, out):
    out.write_bytes(b"".join(log.read_bytes() for log in logs))


class ManyAgentsTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.work = Path(folder.name)

    def metrics(self, seqs_of_2, late_us, sent=range(10)):
        parts = []
        for id, seqs in ((1, range(10)), (2, seqs_of_2), (3, range(5))):
            write_log(self.work / f"agent_{id}.lcm", id, sent if id < 3 else range(7))
            parts.append(self.work / f"part_{id}.lcm")
            write_log(parts[-1], id, seqs, late_us=late_us)
        for name in ("server.lcm", "journal.lcm"):
            join(parts, self.work / name)
        memory = [(0, 1, 10_000, [5_000]), (1, 3, 12_000, [5_000, 6_000, 7_000]), (2, 2, 13_000, [5_000, 6_000])]
        run = Namespace(work=self.work, ids=[1, 2, 3], stopped=2, killed=3, memory=memory, trouble=[2_000_000, 3_000_000])
        return metrics(run, Namespace(agents=3))

    def test_times_and_memory(self):
        found = self.metrics(range(10), 30_000)
        self.assertEqual((found["missing"], found["keyframes_sent"], found["keyframes_journalled"]), (0, 27, 25))
        self.assertEqual((found["calm"]["count"], found["while_one_is_stopped_and_one_dead"]["count"]), (7, 3))
        self.assertEqual((found["calm"]["median_ms"], found["stopped_agent"]["p99_ms"]), (30.0, 30.0))
        self.assertEqual((found["handler_mb_all"], found["uplink_mb_median"], found["handler_mb_end"]), (12.0, 6.0, 13.0))
        self.assertIn("3 agents, 25 of 27 keyframes", table(found))

    def test_what_is_lost_of_an_agent_that_lives_is_missing(self):
        self.assertEqual(self.metrics(range(8), 30_000)["missing"], 2)

    def test_agents_that_send_nothing_are_named(self):
        self.assertEqual(self.metrics(range(10), 30_000)["silent"], [])
        found = self.metrics(range(10), 30_000, sent=())
        self.assertEqual((found["missing"], found["silent"]), (0, [1, 2]))
        self.assertIn("No keyframe of the agents 1, 2 was sent", table(found))

    def test_a_copy_is_another_agents(self):
        write_log(self.work / "one.lcm", 1, range(3))
        copy_for(9, self.work / "one.lcm", self.work / "nine.lcm")
        self.assertEqual([key for key in keyframes(self.work / "nine.lcm")], [(9, 1000, seq) for seq in range(3)])
        data = (self.work / "nine.lcm").read_bytes()
        self.assertIn(b"KEYFRAME_9" + struct.pack(">qi", 1, 9), data)


if __name__ == "__main__":
    unittest.main()
