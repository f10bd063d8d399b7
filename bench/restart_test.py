"""Tests the evaluation of a server's start, with artificial statuses."""

import sys
import unittest
from pathlib import Path
from types import SimpleNamespace

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parent))
from restart_lib.run import metrics  # noqa: E402
from restart_lib.tables import table  # noqa: E402


def status(**counters):
    return SimpleNamespace(cpu_s=2.5, memory_mb=80, counters=[SimpleNamespace(name=n, count=c) for n, c in counters.items()])


class RestartTest(unittest.TestCase):
    def test_ready_counts_from_the_start_of_the_server(self):
        self.assertAlmostEqual(metrics(status(keyframes=3, ready_utime=14_500_000), 10)["ready_s"], 4.5)

    def test_a_process_that_is_not_ready_or_says_nothing(self):
        self.assertIsNone(metrics(status(keyframes=3), 10)["ready_s"])
        self.assertIsNone(metrics(None, 10)["ready_s"])

    def test_the_last_process_decides(self):
        processes = {"fusion": metrics(status(ready_utime=14_500_000), 10), "anchors": metrics(status(ready_utime=12_000_000), 10)}
        start = {"keyframes": 504, "start": 1, "processes": processes}
        self.assertEqual(table([start]).splitlines()[-1], "| 504, 1 | 4.5 | 4.5; 2.5; 80 | 2.0; 2.5; 80 |")
        processes["anchors"] = metrics(None, 10)
        self.assertEqual(table([start]).splitlines()[-1], "| 504, 1 | never | 4.5; 2.5; 80 | never; 0.0; 0 |")


if __name__ == "__main__":
    unittest.main()
