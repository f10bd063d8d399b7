"""Tests a row of the link's table against its session's logs and report."""

import json
import struct
import sys
import tempfile
import time
import unittest
from argparse import Namespace
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parent))
from link_lib.metrics import LCM_SYNC, Row, decode_status, events, keyframes, rungs, strangers, table  # noqa: E402
from link_lib.hosts_session import Watch  # noqa: E402
from link_lib.plan import HOST_ROWS, ROWS, Agent, jobs_of, label, session_yaml  # noqa: E402


def text(value):
    return struct.pack(">i", len(value) + 1) + value.encode() + b"\0"


def status(process, refused, counters, pending=0):
    def counts(of):
        return struct.pack(">h", len(of)) + b"".join(text(name) + struct.pack(">q", count) for name, count in of.items())

    numbers = struct.pack(">qqqqqffff", 1, 2, pending, 0, 0, 0.1, 0.2, 30, 1.5)
    return bytes(8) + text(process) + struct.pack(">qqi", 9, 1, 77) + text("all is well") + numbers + counts(refused) + counts(counters)


def event(channel, utime, data):
    return struct.pack(">IqqII", LCM_SYNC, 0, utime, len(channel), len(data)) + channel.encode() + data


def write_log(path, agent, seqs, late_us=0):
    with open(path, "wb") as file:
        for number, seq in enumerate(seqs):
            channel = f"KEYFRAME_{agent}".encode()
            data = struct.pack(">qiqiq", 1, agent, 1000, seq, 500_000 * seq) + bytes(100)
            header = struct.pack(">IqqII", LCM_SYNC, number, 500_000 * seq + late_us, len(channel), len(data))
            file.write(header + channel + data)


class LinkTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.work = Path(folder.name)
        write_log(self.work / "stored.lcm", 1, range(10))
        self.options = Namespace(agents=[Agent(1, self.work / "stored.lcm", self.work)], seconds=None, bin=".",
                                 rows=list(ROWS), port=24600, hosts=False)

    def row(self, name, journalled, ate, opened=3):
        job = next(job for job in jobs_of(self.options, self.work) if job.name == name)
        session = job.folder / "session"
        session.mkdir(parents=True)
        write_log(session / "agent_1.lcm", 1, range(10))
        write_log(session / "session.lcm", 1, range(10), late_us=30_000)
        write_log(session / "journal.lcm", 1, journalled)
        counters = {"keyframe_bytes": 1000, "bytes_up_keyframes": 1100, "packets_up_keyframes": 1, "packets_up": 3, "bytes_up": 2000}
        with open(session / "agent_1.lcm", "ab") as log:
            log.write(event("STATUS_uplink_1", 6_000_000, status("uplink_1", {}, {"keyframe_bytes": 5})))
            log.write(event("STATUS_uplink_1", 7_000_000, status("uplink_1", {}, counters)))
        with open(session / "session.lcm", "ab") as log:
            log.write(event("STATUS_agent_handler", 7_000_000,
                            status("agent_handler", {"forged": 4, "repeated": 3}, {"packets_1": opened})))
        report = {"groups": [{"agents": [1]}], "ate_joint_m": ate,
                  "fused_at": [{"change": "fused", "session_s": 7.53}]}
        (session / "report.json").write_text(json.dumps(report))
        return Row(job, self.options)

    def test_reads_keyframes_and_stops_at_a_torn_tail(self):
        log = self.work / "stored.lcm"
        log.write_bytes(log.read_bytes()[:-1])
        self.assertEqual([seq for _, _, seq in keyframes(log)], list(range(9)))

    def test_metrics_of_a_session(self):
        metrics = self.row("perfect", range(10), 0.01).metrics
        self.assertEqual((metrics["keyframes_sent"], metrics["keyframes_journalled"]), (10, 10))
        self.assertEqual((metrics["late_median_s"], metrics["fused_s"]), (0.03, 7.6))
        self.assertEqual((metrics["bytes_up"], metrics["bytes_compressed"]), (2000, 1000))
        self.assertEqual((metrics["keyframes_over_compressed"], metrics["packets_refused"]), (1.1, 7))
        self.assertAlmostEqual(metrics["keyframes_given_to_lcm_over_compressed"], (1100 - 46) / 1000)
        self.assertEqual(metrics["handler_cpu_s"], 1.5)

    def test_a_status_of_an_uplink(self):
        data = status("uplink_1", {"a reason": 9}, {"rung": 3, "bytes_up": 70_000})
        self.assertEqual(decode_status(data)["counters"], {"rung": 3, "bytes_up": 70_000})
        self.assertEqual(decode_status(data)["summary"], "all is well")
        self.assertEqual(rungs([(0, {"counters": {"rung": 3}}), (1, {"counters": {"rung": 4}}), (2, {"counters": {}})]), (3.5, 4))

    def test_a_budget_costs_accuracy_but_no_keyframe(self):
        perfect = self.row("perfect", range(10), 0.010)
        coarse, torn = self.row("budget_10", range(10), 0.030), self.row("budget_20", range(9), 0.010)
        rows = [perfect, coarse, torn]
        self.assertEqual([row.passes(rows) for row in rows], [True, True, False])
        self.assertIn("uplink: {budget_kb_per_s: 10}, link: {seed: 1}", session_yaml(self.options, ROWS["budget_10"]))

    def test_passes_only_whole_and_the_same(self):
        perfect = self.row("perfect", range(10), 0.010)
        good, wrong = self.row("loss_5", range(10), 0.014), self.row("loss_10", range(10), 0.016)
        torn = self.row("loss_20", range(9), 0.010)
        rows = [perfect, good, wrong, torn]
        self.assertEqual([row.passes(rows) for row in rows], [True, True, False, False])
        self.assertEqual(len(table(rows).splitlines()), 6)

    def test_a_forged_packet_that_opens_is_a_failure(self):
        rows = [self.row("perfect", range(10), 0.010), self.row("forged", range(10), 0.010, opened=3)]
        self.assertTrue(rows[1].passes(rows))
        rows[1].metrics["packets_opened"] = 4
        self.assertFalse(rows[1].passes(rows))

    def test_the_forger_runs_the_session(self):
        job = next(job for job in jobs_of(self.options, self.work) if job.name == "forged")
        argv = job.commands[0].argv
        session = argv[argv.index("--") + 1:]
        self.assertTrue(session[0].endswith("pangea-session"))
        self.assertEqual(session[-2:], ["--port", "24600"])
        self.assertIn(":24601?", argv[argv.index("--link") + 1])
        self.assertIn(":24603?", argv[argv.index("--overhear") + 1])

    def test_a_session_for_a_row(self):
        self.options.seconds = 60
        text = session_yaml(self.options, ROWS["loss_10"])
        self.assertIn("link: {loss: 0.1, seed: 1}", text)
        self.assertIn("duration: 60", text)


    def test_hosts_of_their_own(self):
        self.options.hosts, self.options.rows, self.options.seconds = True, ["loss_5", "packets_4096_loss_5"], 60
        job = jobs_of(self.options, self.work)[1]
        row = json.loads(job.files["row.json"])
        self.assertEqual((row["loss"], row["packet_bytes"], row["seconds"], row["partition"]), (0.05, 4096, 60, None))
        self.assertTrue(job.commands[0].argv[1].endswith("hosts_session.py"))
        self.assertEqual(label(self.options, "packets_4096_loss_5"), "packet_bytes: 4096, loss: 0.05")
        for name in HOST_ROWS:
            self.assertTrue(label(self.options, name))

    def test_what_strangers_said_is_told_from_what_was_taken(self):
        log = self.work / "server.lcm"
        log.write_bytes(event("RESEND_REQUEST", 1, bytes(100)) * 3 + event("RESEND_REQUEST", 1, b"real" + bytes(96)) +
                        event("STATUS_a", 1, status("a", {"resend_request_t does not decode": 1}, {})) +
                        event("STATUS_a", 2, status("a", {"resend_request_t does not decode": 2, "another": 5}, {})))
        self.assertEqual(strangers(log), {"strangers_heard_by_logger": 3, "strangers_taken": 2})

    def test_a_session_is_idle_when_nobody_has_work_and_nothing_is_sent(self):
        log, watch = self.work / "server.lcm", Watch()
        now = int(1e6 * time.time())
        watch.read[log] = 0
        log.write_bytes(event("STATUS_a", now, status("a", {}, {}, pending=1)))
        self.assertFalse(watch.idle(["a"], 0))
        log.write_bytes(log.read_bytes() + event("STATUS_a", now, status("a", {}, {})))
        self.assertTrue(watch.idle(["a"], 0))
        self.assertFalse(watch.idle(["a", "b"], 0), "b has not said anything")
        self.assertFalse(watch.idle(["a"], 2.5), "it has been quiet for too short a time")
        self.assertEqual(watch.read[log], log.stat().st_size)
        self.assertEqual(list(events(log, watch.read[log])), [])


if __name__ == "__main__":
    unittest.main()
