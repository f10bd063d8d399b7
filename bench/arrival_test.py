"""Tests the orders of arrival, and reading and writing of their logs."""

import sys
import tempfile
import unittest
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parent))
from arrival_lib import log, orders  # noqa: E402

EVENTS = [log.Event(1000 + 10 * i, f"KEYFRAME_{1 + i % 2}", bytes([i])) for i in range(40)]


def of(channel, events):
    return [event.data for event in sorted(events, key=lambda event: event.utime) if event.channel == channel]


class ArrivalTest(unittest.TestCase):
    def test_each_order_has_all_keyframes_and_each_agents_in_order(self):
        seen = set()
        for name, order in orders.ten(EVENTS):
            for channel in ("KEYFRAME_1", "KEYFRAME_2"):
                self.assertEqual(of(channel, order), of(channel, EVENTS), name)
            self.assertGreater(min(event.utime for event in order), 0)
            seen.add(tuple(event.data for event in sorted(order, key=lambda event: event.utime)))
        self.assertEqual(len(seen), 10)

    def test_the_whole_of_one_agent_comes_first(self):
        order = dict(orders.ten(EVENTS))["shifted by -1"]
        first = sorted(order, key=lambda event: event.utime)[:20]
        self.assertEqual({event.channel for event in first}, {"KEYFRAME_2"})

    def test_a_log_is_read_as_it_was_written(self):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "log.lcm"
            log.write(path, reversed(EVENTS))
            self.assertEqual(log.read(path), EVENTS)
            path.write_bytes(path.read_bytes() + b"x" * 64)
            with self.assertRaisesRegex(ValueError, "no event at byte"):
                log.read(path)


if __name__ == "__main__":
    unittest.main()
