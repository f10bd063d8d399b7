#!/usr/bin/env python3
"""pangea-python against LCM itself: every type, the keyword, short messages and fragments both ways. PYTHONPATH has the package."""

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
    """Around the limits of a datagram, and far beyond."""
    return [1, 65490, 65491, 65492, 65493, 70000, 131000, 500000]


class Python(unittest.TestCase):
    def setUp(self):
        self.bus = Bus(URL)

    def tearDown(self):
        self.bus.close()

    def receive(self, channels, count, message_type=None):
        got = []
        self.bus.subscribe(channels, lambda channel, message: got.append((channel, message)), message_type)
        yield  # what is subscribed to may come now
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
                time.sleep(0.05)  # its queue is 30 messages deep
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


if __name__ == "__main__":
    sys.exit(unittest.main())
