#!/usr/bin/env python3
"""Compares docs/bus.md with the code and a log: every type, every channel, the modules that name it, the largest size."""

import re
import struct
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
DOC = (ROOT / "docs/bus.md").read_text()
SAMPLE = ROOT / "logs/two_walks/session.lcm"


def table(heading):
    """Rows of the first table of a section, as lists of cells."""
    section = DOC.split(f"\n## {heading}\n")[1].split("\n## ")[0]
    rows = [line for line in section.splitlines() if line.startswith("| ")]
    return [[cell.strip() for cell in row.strip("|").split(" | ")] for row in rows[1:]]


def quoted(text):
    return re.findall(r"`([^`]+)`", text)


# Listen<have_t>(channels::kHave, Subscribe<imu_t>(channels::Imu(... or (std::string(channels::kAllPoses)
SUBSCRIPTION = re.compile(r"(?:Subscribe|Listen)<(\w+)>\(\s*(?:std::string\()?channels::(\w+)")


BOTH_TYPES = {"KeyframeMessage": "keyframe_4_t"}  # decodes the older types too


def channels_in_code():
    """The channels of modules/messages/channels.h, from constants and functions, spelt as in the document."""
    header = (ROOT / "modules/messages/channels.h").read_text()
    constants = dict(re.findall(r'\bstd::string_view (k\w+) = "([^"]+)";', header))
    functions = re.findall(r"\bstd::string (\w+)\([\w:]+ (agent_id|process)\) \{\s*return [^;]*\b(k\w+Prefix)\b", header)
    spelt = {name: value.replace("[0-9]+", "k").replace(".*", "<process>") for name, value in constants.items()
             if not name.endswith("Prefix")}
    spelt |= {name: constants[prefix] + {"agent_id": "k", "process": "<process>"}[kind] for name, kind, prefix in functions}
    unused = {name for name in constants if name.endswith("Prefix")} - {prefix for _, _, prefix in functions}
    assert not unused, unused
    return spelt


CHANNEL_OF = channels_in_code()
CHANNELS = [(quoted(row[0])[0], row) for row in table("Channels")]


def documented(channel):
    """The documented channels that describe this channel of the bus."""
    pattern = {"k": r"[0-9]+", "<process>": r"\w+"}
    return [row for name, row in CHANNELS
            if re.fullmatch(re.sub(r"(?<=_)(k|<process>)$", lambda m: pattern[m[0]], name), channel)]


def types_of_fields(type_file):
    text = re.sub(r"//.*", "", type_file.read_text())
    body = text[text.index("{") + 1:text.rindex("}")]
    return {member.split()[0] for member in body.split(";") if member.strip()}


def bytes_of(text):
    number, unit = re.fullmatch(r"([\d.]+) (B|kB)", text).groups()
    return float(number) * (1000 if unit == "kB" else 1)


def log_events(path):
    """(channel, size) of an LCM log."""
    data = path.read_bytes()
    at = 0
    while at < len(data):
        channel_bytes, size = struct.unpack(">II", data[at + 20:at + 28])
        yield data[at + 28:at + 28 + channel_bytes].decode(), size
        at += 28 + channel_bytes + size


class BusDoc(unittest.TestCase):
    def test_every_type_has_a_channel_or_is_a_part(self):
        types = {path.stem for path in (ROOT / "lcmtypes").glob("*.lcm")}
        on_channels = {quoted(row[1])[0] for _, row in CHANNELS if quoted(row[1])}
        self.assertLessEqual(on_channels, types)
        parts = set().union(*(types_of_fields(ROOT / f"lcmtypes/{name}.lcm") for name in types))
        self.assertEqual(types - on_channels - parts, set())

    def test_every_channel(self):
        self.assertEqual({name for name, _ in CHANNELS}, set(CHANNEL_OF.values()))

    def test_subscriptions_in_the_code(self):
        """Each has the type of a documented row, and its module is in the row."""
        checked = 0
        for path in (ROOT / "modules").rglob("*.cc"):
            if path.name.endswith("_test.cc") or "node_modules" in path.parts:
                continue
            for type_name, symbol in SUBSCRIPTION.findall(path.read_text()):
                rows = [row for name, row in CHANNELS if name == CHANNEL_OF[symbol]]
                self.assertTrue(rows, f"{path.name}: channels::{symbol} is {CHANNEL_OF[symbol]}")
                self.assertEqual({quoted(row[1])[0] for row in rows}, {BOTH_TYPES.get(type_name, type_name)}, symbol)
                module = path.relative_to(ROOT / "modules").parts[0]
                if module not in ("bus", "journal_follower", "loop_verification", "phone"):  # helpers of several processes, and a module with its own bus
                    self.assertTrue(any(module in row[3] for row in rows), f"{module} listens to {rows[0][0]}")
                checked += 1
        self.assertGreater(checked, 20)

    def test_the_sample_is_within_the_sizes(self):
        seen = set()
        for channel, size in log_events(SAMPLE):
            if channel == "LCM_SELF_TEST":
                continue
            rows = documented(channel)
            self.assertTrue(rows, channel)
            self.assertLessEqual(size, min(bytes_of(row[5]) for row in rows), channel)
            seen.add(rows[0][0])
        self.assertGreater(len(seen), 9)

    def test_default_urls_are_the_programs(self):
        described = set(quoted(" ".join(row[2] for row in table("Three buses"))))
        sources = [ROOT / "modules" / name for name in ("link/wire.h", "bus/bus.h")]
        in_code = {url for path in sources for url in re.findall(r'"(udpm://[^"]+)"', path.read_text())}
        self.assertEqual(in_code, {url for url in described if url.startswith("udpm")})

    def test_links_lead_somewhere(self):
        for link in re.findall(r"\]\(([^)]+)\)", DOC):
            self.assertTrue((ROOT / "docs" / link.split("#")[0]).exists(), link)


if __name__ == "__main__":
    unittest.main()
