"""Tests the session that bench/anchors writes, and its evaluation of a report."""

import json
import math
import struct
import sys
import tempfile
import unittest
from argparse import Namespace
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parent))
from anchors_lib.field import KILLED, next_day_yaml, session_yaml  # noqa: E402
from anchors_lib.metrics import metrics, table  # noqa: E402
from anchors_lib.reference import Camera, Reference, fill_next_day, summary  # noqa: E402
from real_lib import rotations as rot  # noqa: E402
from real_lib import trajectory  # noqa: E402


def agent(error, jump):
    return {"id": 2, "error_m": error, "error_px": None if error is None else 100 * error,
            "largest_jump_m": jump}


class AnchorsTest(unittest.TestCase):
    def options(self, **given):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        camera = Path(folder.name) / "mav0/cam0"
        camera.mkdir(parents=True)
        (camera / "sensor.yaml").write_text("rate_hz: 20\nresolution: [752, 480]\n")
        (camera / "data.csv").write_text("#\n5000000000,a.png\n65000000000,b.png\n")
        recordings = [Path(folder.name), Path(folder.name)]
        return Namespace(**{"recordings": recordings, "seconds": 60, "anchors": 20, "cut": None, "swap": False, **given})

    def session(self, condition, truth=None, **given):
        return json.loads(session_yaml(condition, self.options(**given), truth))

    def test_anchors_are_spread_over_time_and_image(self):
        anchors = self.session("good")["anchors"]
        self.assertEqual(len({anchor["name"] for anchor in anchors}), 20)
        self.assertEqual((anchors[0]["at"], anchors[-1]["at"]), (6, 36))
        self.assertEqual(anchors[0]["pixel"], [376, 240])
        for u, v in (anchor["pixel"] for anchor in anchors):
            self.assertTrue(0 < u < 752 and 0 < v < 480)

    def test_one_recording_is_cut_in_two(self):
        session = self.session("good", truth=[2, 8, 9.5, 12, 29.5, 40, 55], cut=30, anchors=4)
        self.assertEqual([anchor["at"] for anchor in session["anchors"]], [8, 8, 9.5, 12])
        first, second = session["agents"]
        self.assertEqual((first["start"], first["duration"]), (0, 30))
        self.assertEqual((second["start"], second["duration"], second["delay"]), (30, 30, 30))
        swapped = self.session("killed", truth=[2, 8, 20, 40, 55], swap=True, anchors=2)
        self.assertEqual([anchor["at"] for anchor in swapped["anchors"]], [40, 55])
        self.assertEqual([agent["start"] for agent in swapped["agents"]], [30, 0])
        with self.assertRaises(SystemExit):
            self.session("good", truth=[40], cut=30)

    def test_conditions(self):
        self.assertNotIn("faults", self.session("good"))
        self.assertEqual(self.session("lossy")["agents"][1]["link"], {"loss": 0.2, "delay_ms": 2000})
        faults = self.session("killed")["faults"]
        self.assertEqual([fault["kill"] for fault in faults], KILLED)
        self.assertTrue(all(10 <= fault["at"] < 60 for fault in faults))

    def test_next_day_is_two_sessions(self):
        options = self.options()
        today, tomorrow = map(json.loads, next_day_yaml(options))
        self.assertEqual(len(today["anchors"]), 20)
        self.assertEqual([agent["id"] for agent in today["agents"]], [1])
        self.assertEqual(tomorrow["agents"], [{"id": 2, "recording": str(options.recordings[1].resolve()), "duration": 60}])

    def test_metrics(self):
        anchors = [{"name": "a", "agents": [agent(0.01, 0.002)]}, {"name": "b", "agents": [agent(0.03, 0.001)]},
                   {"name": "c", "agents": [agent(None, None)]}, {"name": "b", "agents": []}]
        found = metrics({"anchors": anchors}, 4)
        self.assertEqual((found["shown"], found["lost"], found["doubled"]), (2, 2, 1))
        self.assertEqual(found["error_m"], {"median": 0.02, "worst": 0.03, "anchors": 2})
        self.assertIsNone(found["error_end_m"])
        self.assertIn("| good | 2 | 0.020; 0.030 |", table({"good": found, "killed": None}))

    def test_errors_of_none_are_not_counted_in_pixels(self):
        found = metrics({"anchors": [{"name": "a", "agents": [agent(0.01, 0.0) | {"error_px": None}]}]}, 1)
        self.assertIsNone(found["error_px"])


T_BODY_CAM = (rot.normalised((1.0, 0.2, 0.0, 0.1)), (0.1, 0.0, 0.05))
T_ODOM_REF = [(rot.normalised((1.0, 0.0, 0.0, yaw)), (yaw, 2.0, 0.0)) for yaw in (0.3, -0.4)]
SCALE = 2.0  # metres of the map per unit of the reference


def camera_at(t):
    """T_ref_cam: a walk past the origin, with the camera towards it."""
    return rot.normalised((1.0, 0.02 * math.sin(t), 0.02 * t, 0.0)), (0.2 * math.sin(t), 0.1 * t, 0.05 * math.cos(t) - 1)


def body_in_odom(agent, t, scale):
    q, p = camera_at(t)
    return rot.compose(rot.compose(T_ODOM_REF[agent - 1], (q, rot.scaled(scale, p))), rot.inverse(T_BODY_CAM))


def rigid3(T):
    return struct.pack(">7d", *T[0], *T[1])


def text(said):
    return struct.pack(">i", len(said) + 1) + said.encode() + b"\0"


def event(wall_s, channel, data):
    data = bytes(8) + data
    return struct.pack(">IqqII", 0xEDA1DA01, 0, int(1e6 * wall_s), len(channel), len(data)) + channel.encode() + data


class ReferenceTest(unittest.TestCase):
    """A walk: agent 1 has the seconds 0 to 10, agent 2 the seconds 20 to 40; the reference has all poses at half the size."""

    PLACED_S = 4.0
    P_CAM = (0.1, 0.2, 1.5)  # where agent 1 places the anchor

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.work = Path(folder.name)
        for sensor, T, more in (("imu0", ((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), ""),
                                ("cam0", T_BODY_CAM, "resolution: [640, 480]\nintrinsics: [400, 400, 320, 240]\n")):
            (self.work / "mav0" / sensor).mkdir(parents=True)
            rows = zip(*(rot.rotate(T[0], axis) for axis in ((1, 0, 0), (0, 1, 0), (0, 0, 1))), T[1])
            data = ", ".join(f"{x:.12f}" for row in rows for x in row)
            (self.work / "mav0" / sensor / "sensor.yaml").write_text(f"data: [{data}]\n{more}")
        (self.work / "mav0/cam0/data.csv").write_text("100000000000,a.png\n")
        stamps = [x / 2 for x in range(20)] + [20 + x / 2 for x in range(40)]
        (self.work / "reference.colmap.tum").write_text(trajectory.tum([(100 + t, camera_at(t)) for t in stamps]))

    def pose(self, agent, t, scale):
        head = struct.pack(">qb", int(1e6 * (100 + t)), 2) + text("")
        return event(t, f"POSE_{agent}", head + struct.pack(">iq", agent, 7) + rigid3(body_in_odom(agent, t, scale)))

    def session(self, scale=SCALE):
        """Agent 2 shows the anchor from 25 s on, and from 26 s on with an additional error of 6 mm."""
        identity = struct.pack(">iq", 1, 55)
        T_odom_body = body_in_odom(1, self.PLACED_S, scale)
        T_odom_anchor = rot.compose(rot.compose(T_odom_body, T_BODY_CAM), ((1.0, 0.0, 0.0, 0.0), self.P_CAM))
        heard = identity + struct.pack(">qib", 1, 1, 1) + text("a") + text("") + struct.pack(">iqiqq", 1, 7, 1, 7, 0) + rigid3(T_odom_anchor)
        edit = (identity + struct.pack(">qibqb", 1, 1, 2, 0, 0) + text("a") + text("") +
                struct.pack(">biqiq", 4, 1, 7, 0, int(1e6 * (100 + self.PLACED_S))) + rigid3(T_odom_anchor) + b"\1" + rigid3(T_odom_body))
        q, p = rot.compose(rot.compose(T_ODOM_REF[1], rot.inverse(T_ODOM_REF[0])), T_odom_anchor)

        def shown(off):
            return struct.pack(">qiqh", 0, 2, 7, 1) + identity + struct.pack(">q", 1) + rigid3((q, rot.add(p, off)))

        first, second = [x / 10 for x in range(100)], [20 + x / 10 for x in range(200)]
        said = {25: event(25, "SHOWN_ANCHORS_2", shown((0.024, 0.0, 0.0))), 26: event(26, "SHOWN_ANCHORS_2", shown((0.03, 0.0, 0.0)))}
        (self.work / "agent_1.lcm").write_bytes(b"".join(self.pose(1, t, scale) for t in first) + event(12, "ANCHOR_1", heard))
        (self.work / "agent_2.lcm").write_bytes(b"".join(self.pose(2, t, scale) + said.get(t, b"") for t in second))
        (self.work / "session.lcm").write_bytes(event(5, "ANCHOR_EDIT", edit))
        for agent, times in ((1, first), (2, second)):  # the joint map is agent 1's odom frame
            back = rot.compose(T_ODOM_REF[0], rot.inverse(T_ODOM_REF[agent - 1]))
            (self.work / f"agent_{agent}.tum").write_text(
                trajectory.tum([(100 + t, rot.compose(back, body_in_odom(agent, t, scale))) for t in times[::10]]))

    def test_error_in_the_metres_of_the_map(self):
        self.session()
        anchors = [{"id": "1/55", "agents": [{"id": 2}]}, {"id": "1/56", "agents": [{"id": 2}]}, {"id": None, "agents": []}]
        reference = Reference(self.work)
        self.assertEqual(reference.seconds()[:2], [0, 0.5])
        reference.fill({"anchors": anchors}, self.work)
        found = anchors[0]["agents"][0]
        self.assertTrue(found["shown"])
        self.assertAlmostEqual(found["error_m"], 0.03, places=4)
        self.assertAlmostEqual(found["error_10s_m"], 0.03, places=4)
        self.assertFalse(anchors[1]["agents"][0]["shown"])
        self.assertEqual(metrics({"anchors": [{"name": "a", **anchors[0]}, {"name": "b", **anchors[1]}]}, 2)["lost"], 1)

    def test_next_day_by_ground_truth(self):
        self.session(scale=1)
        folder = self.work / "mav0/state_groundtruth_estimate0"
        folder.mkdir()
        poses = [(100 + t / 10, rot.compose(camera_at(t / 10), rot.inverse(T_BODY_CAM))) for t in range(401)]
        (folder / "data.csv").write_text("".join(
            f"{round(1e9 * t)}," + ",".join(map(str, (*T[1], *T[0]))) + "\n" for t, T in poses))
        report = {"anchors": [{"name": "a", "id": "1/55", "agents": []}, {"name": "b", "id": "1/56", "agents": []}]}
        fill_next_day(report, self.work, self.work, [self.work, self.work])
        found = report["anchors"][0]["agents"][0]
        self.assertAlmostEqual(found["error_m"], 0.03, places=4)
        self.assertAlmostEqual(found["largest_jump_m"], 0.006, places=6)
        self.assertAlmostEqual(report["localised_s"], 5.1, places=3)  # it is shown with the first pose after 25 s
        self.assertEqual(metrics(report, 2)["lost"], 1)

    def test_pixels_and_view(self):
        camera = Camera((640, 480), (400, 400, 320, 240))
        self.assertAlmostEqual(camera.pixels((0.1, 0, 2), (0, 0, 2)), 20)
        self.assertIsNone(camera.pixels((0, 0, 2), (3, 0, 2)))
        self.assertEqual(camera.pixels((0, 0, -1), (0, 0, 2)), 800)
        errors = [(0, 0.05, 2.0, 3.0), (5, 0.02, 2.0, None), (10, 0.03, 2.0, 1.0), (12, 0.01, 2.0, None)]
        self.assertEqual(summary(errors), {"shown": True, "error_m": 0.02, "error_max_m": 0.03, "error_10s_m": 0.03, "error_end_m": 0.01,
                                           "error_in_view_m": 0.04, "error_in_view_share": 0.02, "error_px": 2.0})


if __name__ == "__main__":
    unittest.main()
