#!/usr/bin/env python3
"""Tests the evaluation of a run of a hundred agents, with artificial logs."""

import json
import struct
import sys
import tempfile
import unittest
from argparse import Namespace
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parent))
from hundred_agents_lib.metrics import is_good, metrics, table  # noqa: E402
from link_lib.metrics import LCM_SYNC  # noqa: E402

OPENED = 1000


def space(value):
    """Dictionaries as objects like messages."""
    if isinstance(value, dict):
        return Namespace(**{name: space(of_name) for name, of_name in value.items()})
    return [space(one) for one in value] if isinstance(value, list) else value


def keyframe(agent, seq, utime):
    return utime, f"KEYFRAME_{agent}", struct.pack(">qiqiq", 1, agent, OPENED, seq, utime) + bytes(10)


def correction(agent, seq, utime):
    return utime, f"CORRECTION_{agent}", json.dumps({"map": {"opened_utime": OPENED}, "seq": seq}).encode()


def constraint(from_agent, agent, seq, accepted=True):
    to = {"map": {"agent_id": agent, "opened_utime": OPENED}, "seq": seq}
    return 0, "CONSTRAINT", json.dumps({"accepted": accepted, "from_": {"map": {"agent_id": from_agent}}, "to": to}).encode()


def state(*agents):
    return 0, "MAP_STATE", json.dumps({"maps": [{"agent_id": agent} for agent in agents]}).encode()


class HundredAgentsTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.work = Path(folder.name)
        (self.work / "logs").mkdir()
        site = Namespace(name="site_1", folder=self.work / "site_1", agents=range(6, 9))
        site.folder.mkdir()
        self.run_ = Namespace(work=self.work, sites=[site], took_s=9, memory_kb={"pangea-fusion": {"7": 2000, "8": 4000}},
                              cpu_s={"pangea-fusion": {"7": 1.5, "8": 2.5}},
                              options=Namespace(agents=3, rate=0.5), expected_groups=lambda: [[1, 2], [3]])
        self.keyframes = {agent: [keyframe(agent, seq, 1_000_000 * (seq + 1)) for seq in range(3)] for agent in site.agents}
        self.corrections = {6: [correction(6, 0, 1_500_000), correction(6, 1, 2_300_000)],
                            7: [correction(7, 1, 2_500_000), correction(7, 2, 3_100_000)], 8: []}
        self.lost = 0  # keyframes lost from the journal's end
        self.server = [constraint(6, 7, 0), constraint(6, 7, 2), constraint(7, 6, 1), constraint(7, 6, 2, accepted=False),
                       constraint(7, 8, 1), state(6), state(6, 7), state(8)]

    def write(self, name, log):
        with open(self.work / name, "wb") as file:
            for number, (utime, channel, data) in enumerate(log):
                header = struct.pack(">IqqII", LCM_SYNC, number, utime, len(channel), len(data))
                file.write(header + channel.encode() + data)

    def metrics(self):
        for agent, of_agent in self.keyframes.items():
            self.write(f"logs/agent_{agent}.lcm", of_agent + self.corrections[agent])
        journalled = [one for of_agent in self.keyframes.values() for one in of_agent]
        self.write("site_1/journal.lcm", journalled[:len(journalled) - self.lost])
        self.write("logs/site_1.lcm", self.server)
        as_json = Namespace(decode=lambda data: space(json.loads(data)))
        return metrics(self.run_, Namespace(correction_t=as_json, constraint_t=as_json, map_state_t=as_json))

    def test_all_is_well(self):
        found = self.metrics()
        self.assertTrue(is_good(found), found)
        self.assertEqual((found["sent"], found["missing"], found["strange"], found["accepted"]), (9, 0, 0, 4))
        # Keyframe 0 of agent 7 was sent before its map was fused; keyframe 1 of agent 8 is in another group than agent 7.
        self.assertEqual((found["first"]["count"], found["first"]["median_ms"]), (1, 1500))
        self.assertEqual((found["corrected"]["count"], found["corrected"]["median_ms"]), (2, 200))
        self.assertIn("| pangea-fusion | 2 | 4.0 | 4.0 | 4.0 |", table(found))

    def test_a_keyframe_in_no_journal(self):
        self.lost = 1
        found = self.metrics()
        self.assertEqual(found["missing"], 1)
        self.assertFalse(is_good(found))

    def test_a_keyframe_of_another_site(self):
        self.keyframes[1] = [keyframe(1, 0, 5)]
        self.corrections[1] = []
        self.assertEqual(self.metrics()["strange"], 1)

    def test_a_constraint_that_corrects_nothing(self):
        del self.corrections[7][1]
        found = self.metrics()
        self.assertEqual(found["not_corrected"], 1)
        self.assertFalse(is_good(found))

    def test_other_groups_than_the_replay(self):
        self.server.append(state(6, 7, 8))
        self.assertFalse(is_good(self.metrics()))


if __name__ == "__main__":
    unittest.main()
