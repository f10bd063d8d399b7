#!/usr/bin/env python3
"""Tests pangea-python against LCM itself: every type, the keyword, short messages and fragments in both directions. PYTHONPATH has the package."""

import importlib
import os
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

import pangea
from pangea.bus import Bus, image_chunks

ROOT = Path(__file__).resolve().parents[1]
SAMPLE = ROOT / "logs/two_walks/session.lcm"
URL = f"udpm://239.255.76.67:{20000 + os.getpid() % 10000}?ttl=0&recv_buf_size=4194304"


def log_events(data):
    """(channel, payload) of an LCM log."""
    at = 0
    while at < len(data):
        name, size = (int.from_bytes(data[at + i:at + i + 4], "big") for i in (20, 24))
        yield data[at + 28:at + 28 + name].decode(), data[at + 28 + name:at + 28 + name + size]
        at += 28 + name + size


def sizes():
    """Sizes around the limits of a datagram, and far beyond."""
    return [1, 65490, 65491, 65492, 65493, 70000, 131000, 500000]


class Python(unittest.TestCase):
    def setUp(self):
        self.bus = Bus(URL)

    def tearDown(self):
        self.bus.close()

    def receive(self, channels, count, message_type=None):
        got = []
        self.bus.subscribe(channels, lambda channel, message: got.append((channel, message)), message_type)
        yield  # from here on the subscribed messages may come
        deadline = time.monotonic() + 20
        while len(got) < count and time.monotonic() < deadline:
            self.bus.handle(0.2)
        yield got

    def test_every_type_comes_back(self):
        for path in (ROOT / "lcmtypes").glob("*.lcm"):
            message_type = getattr(importlib.import_module("pangea"), path.stem)
            message = message_type()
            self.assertEqual(message_type.decode(message.encode()).encode(), message.encode(), path.stem)

    def test_messages_of_the_server_come_back_byte_for_byte(self):
        types = {"CONSTRAINT": pangea.constraint_t, "MAP_STATE": pangea.map_state_t, "PLACE_MATCH": pangea.place_match_t}
        seen = set()
        for channel, data in log_events(SAMPLE.read_bytes()):
            message_type = types.get(channel, pangea.keyframe_t if channel.startswith("KEYFRAME_") else None)
            if message_type:
                message = message_type.decode(data)
                self.assertEqual(message.encode(), data)
                seen.add(message_type)
                if message_type is pangea.constraint_t:
                    self.assertGreaterEqual(message.from_.seq, 0)
        self.assertEqual(len(seen), 4)

    def test_to_itself_short_and_in_fragments(self):
        receiving = self.receive("BYTES_[0-9]+", len(sizes()))
        next(receiving)
        sent = [(f"BYTES_{i}", os.urandom(size)) for i, size in enumerate(sizes())]
        self.bus.publish("BYTES_1_NOT", b"another channel")
        for channel, data in sent:
            self.bus.publish(channel, data)
        self.assertEqual(next(receiving), sent)

    def test_another_group_on_the_port_is_another_bus(self):
        other = Bus(URL.replace("76.67", "76.99"))
        receiving = self.receive("A", 1)
        next(receiving)
        other.publish("A", b"theirs")
        self.bus.publish("A", b"ours")
        self.assertEqual(next(receiving), [("A", b"ours")])
        other.close()

    def test_what_does_not_decode_is_counted(self):
        receiving = self.receive("POSE_1", 1, pangea.pose_t)
        next(receiving)
        pose = pangea.pose_t()
        pose.utime = 7
        self.bus.publish("POSE_1", pangea.vector3_t())
        self.bus.publish("POSE_1", pose.encode()[:20])
        self.bus.publish("POSE_1", pose)
        self.assertEqual([message.utime for _, message in next(receiving)], [7])
        self.assertEqual(self.bus.refused["POSE_1: no pose_t"], 2)

    def test_lcm_logger_takes_what_is_published(self):
        sent = [(f"BYTES_{i}", os.urandom(size)) for i, size in enumerate(sizes())]
        with tempfile.TemporaryDirectory() as folder:
            log = Path(folder) / "log.lcm"
            logger = subprocess.Popen(["lcm-logger", "-q", f"--lcm-url={URL}", str(log)], stdout=subprocess.DEVNULL)
            time.sleep(1)
            for channel, data in sent:
                self.bus.publish(channel, data)
                time.sleep(0.05)  # the logger's queue has only 30 messages
            time.sleep(1)
            logger.terminate()
            logger.wait(10)
            got = [event for event in log_events(log.read_bytes()) if event[0].startswith("BYTES_")]
        self.assertEqual(got, sent)

    def test_what_lcm_logplayer_sends_is_taken(self):
        big = [(f"BIG_{i}", os.urandom(size)) for i, size in enumerate(sizes())]
        receiving = self.receive("BIG_.*", len(big))
        next(receiving)
        with tempfile.TemporaryDirectory() as folder:
            log = Path(folder) / "log.lcm"
            with log.open("wb") as file:
                for i, (channel, data) in enumerate(big):
                    for value, size in ((0xEDA1DA01, 4), (i, 8), (1000 * i, 8), (len(channel), 4), (len(data), 4)):
                        file.write(value.to_bytes(size, "big"))
                    file.write(channel.encode() + data)
            subprocess.run(["lcm-logplayer", f"--lcm-url={URL}", str(log)], check=True, stdout=subprocess.DEVNULL)
            self.assertEqual(next(receiving), big)

    def test_an_image_in_chunks(self):
        png = os.urandom(100000)
        chunks = list(image_chunks(5, png, 640, 480))
        self.assertEqual(b"".join(chunk.data for chunk in chunks), png)
        for i, chunk in enumerate(chunks):
            self.assertLessEqual(len(chunk.encode()), 30000)
            self.assertEqual((chunk.chunk, chunk.num_chunks, chunk.offset_bytes, chunk.total_bytes), (i, 4, 29000 * i, 100000))

    def test_what_cannot_be_opened_says_why(self):
        for url in ("tcpq://127.0.0.1:7700", "udpm://10.0.0.1:7667", "udpm://239.255.76.67:x", "udpm://239.255.76.67:7667?ttl=a"):
            with self.assertRaisesRegex(ValueError, "give udpm://GROUP:PORT"):
                Bus(url)
        with self.assertRaisesRegex(ValueError, "1 to 63 characters"):
            self.bus.publish("C" * 64, b"")


class Examples(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.mav0 = Path(self.folder.name) / "mav0"
        (self.mav0 / "cam0/data").mkdir(parents=True)
        (self.mav0 / "imu0").mkdir()
        transform = "T_BS:\n  data: [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]\n"
        self.write("cam0/sensor.yaml", transform + "resolution: [640, 480]\nintrinsics: [400, 400, 320, 240]\n"
                   "distortion_model: radtan\ndistortion_coefficients: [0, 0, 0, 0]\n")
        self.write("imu0/sensor.yaml", transform)
        self.write("cam0/data.csv", "#stamp,name\n1000000,a.png\n")
        self.write("imu0/data.csv", "#stamp,w,a\n1000000,0,0,0,0,0,9.8\n")
        self.write("cam0/data/a.png", "")

    def write(self, name, text):
        (self.mav0 / name).write_text(text)

    def source(self, *arguments, **environment):
        return subprocess.run([ROOT / "examples/sensor_source/euroc_source.py", *arguments], capture_output=True, text=True, timeout=20,
                              env=os.environ | environment)

    def test_the_sensor_source_names_file_and_line(self):
        def said():
            done = self.source("--agent", "3", "--recording", self.folder.name, "--bus", URL)
            self.assertNotIn("Traceback", done.stderr)
            return done.returncode, done.stderr

        self.assertEqual(said(), (0, ""))
        self.write("cam0/data.csv", "#stamp,name\n1000000,b.png\n1000000,a.png\n")
        code, text = said()  # an image that is missing is left out
        self.assertEqual(code, 0)
        self.assertRegex(text, r"^euroc_source: .*cam0/data/b\.png: is missing, left out\n$")
        self.write("cam0/data.csv", "#stamp,name\nx,a.png\n")
        self.assertRegex(said()[1], r"^euroc_source: .*cam0/data\.csv:2: 'x,a\.png': give a stamp in ns")
        self.write("imu0/data.csv", "1000000,0,0\n")
        self.assertRegex(said()[1], r"^euroc_source: .*imu0/data\.csv:1: '1000000,0,0': give a stamp in ns, three numbers")
        for name in ("cam0/data.csv", "imu0/data.csv"):
            self.write(name, "#stamp\n")
        self.assertRegex(said()[1], r"^euroc_source: .*mav0: imu0/data\.csv and cam0/data\.csv have no rows")
        camera = (self.mav0 / "cam0/sensor.yaml").read_text()
        self.write("cam0/sensor.yaml", camera + "stamp_row: upper\n")
        self.assertRegex(said()[1], r"^euroc_source: .*sensor\.yaml: stamp_row: upper: give first, middle, last")
        self.write("cam0/sensor.yaml", camera.replace("[0, 0, 0, 0]", "[0, 0, 0, 0, 0]"))
        self.assertRegex(said()[1], r"^euroc_source: .*cam0/sensor\.yaml: distortion_coefficients: give 4 numbers, not 5")
        self.write("cam0/sensor.yaml", camera)
        (self.mav0 / "imu0/data.csv").unlink()
        self.assertRegex(said()[1], r"^euroc_source: /.*imu0/data\.csv: No such file or directory\n$")

    def test_the_sensor_source_checks_its_command_line(self):
        for arguments in (["--agent", "0"], ["--agent", "x"], ["--agent", "3", "--rate", "0"]):
            done = self.source(*arguments, "--recording", self.folder.name)
            self.assertEqual(done.returncode, 2, arguments)
            self.assertIn("give ", done.stderr)
        self.assertIn("agent's bus", self.source("--help", PYTHONPATH="").stdout)

    def test_the_anchor_client_names_the_server(self):
        done = subprocess.run([ROOT / "examples/anchors/anchor_client.py", "--server", "http://127.0.0.1:1"], capture_output=True, text=True,
                              timeout=20)
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, r"^anchor_client.py: GET http://127\.0\.0\.1:1/v1/agents: .*refused: is pangea-server running")


if __name__ == "__main__":
    sys.exit(unittest.main())
