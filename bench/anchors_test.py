"""The session that bench/anchors writes, and what it makes of a report."""

import json
import sys
import tempfile
import unittest
from argparse import Namespace
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parent))
from anchors_lib.field import KILLED, session_yaml  # noqa: E402
from anchors_lib.metrics import metrics, table  # noqa: E402


def agent(error, jump):
    return {"id": 2, "error_m": error, "error_px": None if error is None else 100 * error,
            "largest_jump_m": jump}


class AnchorsTest(unittest.TestCase):
    def session(self, condition):
        with tempfile.TemporaryDirectory() as folder:
            camera = Path(folder) / "mav0/cam0"
            camera.mkdir(parents=True)
            (camera / "sensor.yaml").write_text("rate_hz: 20\nresolution: [752, 480]\n")
            options = Namespace(recordings=[Path(folder), Path(folder)], seconds=60, anchors=20)
            return json.loads(session_yaml(condition, options))

    def test_anchors_are_spread_over_time_and_image(self):
        anchors = self.session("good")["anchors"]
        self.assertEqual(len({anchor["name"] for anchor in anchors}), 20)
        self.assertEqual((anchors[0]["at"], anchors[-1]["at"]), (6, 36))
        self.assertEqual(anchors[0]["pixel"], [376, 240])
        for u, v in (anchor["pixel"] for anchor in anchors):
            self.assertTrue(0 < u < 752 and 0 < v < 480)

    def test_conditions(self):
        self.assertNotIn("faults", self.session("good"))
        self.assertEqual(self.session("lossy")["agents"][1]["link"], {"loss": 0.2, "delay_ms": 2000})
        faults = self.session("killed")["faults"]
        self.assertEqual([fault["kill"] for fault in faults], KILLED)
        self.assertTrue(all(10 <= fault["at"] < 60 for fault in faults))

    def test_metrics(self):
        anchors = [{"name": "a", "agents": [agent(0.01, 0.002)]}, {"name": "b", "agents": [agent(0.03, 0.001)]},
                   {"name": "c", "agents": [agent(None, None)]}, {"name": "b", "agents": []}]
        found = metrics({"anchors": anchors}, 4)
        self.assertEqual((found["shown"], found["lost"], found["doubled"]), (2, 2, 1))
        self.assertEqual(found["error_m"], {"median": 0.02, "worst": 0.03})
        self.assertIsNone(found["error_end_m"])
        self.assertIn("| good | 2 | 0.020; 0.030 |", table({"good": found, "killed": None}))

    def test_errors_of_none_are_not_counted_in_pixels(self):
        found = metrics({"anchors": [{"name": "a", "agents": [agent(0.01, 0.0) | {"error_px": None}]}]}, 1)
        self.assertIsNone(found["error_px"])


if __name__ == "__main__":
    unittest.main()
