#!/usr/bin/env python3
"""The MCAP file of a log, read by a reader that shares nothing with its writer: the format's specification
(https://mcap.dev/spec), byte by byte.

    reader_test.py PANGEA_LOG LOG SCRIPTS_MCAP

Summary, chunks and checksums agree with each other, counts with the log; a keyframe and a pose are decoded by the schema
that the file itself gives.
"""

import collections
import json
import os
import struct
import subprocess
import sys
import tempfile
import zlib

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX = range(1, 9)
STATISTICS, DATA_END = 0x0B, 0x0F


class Record:
    """Fields of one record, in the order in which the specification lists them."""

    def __init__(self, content):
        self.rest = content

    def take(self, code):
        value, = struct.unpack_from("<" + code, self.rest)
        self.rest = self.rest[struct.calcsize("<" + code):]
        return value

    def bytes(self, code="I"):
        size = self.take(code)
        value, self.rest = self.rest[:size], self.rest[size:]
        assert len(value) == size, "a record that ends too early"
        return value

    def text(self):
        return self.bytes().decode()

    def counts(self, key, value):
        pairs = Record(self.bytes())
        counts = {}
        while pairs.rest:
            number = pairs.take(key)
            counts[number] = pairs.take(value)
        return counts


def records(data):
    at = 0
    while at < len(data):
        opcode, size = struct.unpack_from("<BQ", data, at)
        content = data[at + 9:at + 9 + size]
        assert len(content) == size, "a record that ends after the file"
        yield opcode, content, at
        at += 9 + size


def fits(value, schema):
    """Whether JSON is of a schema of types, properties and items: all that the writer derives from messages."""
    kinds = {"object": dict, "array": list, "string": str, "boolean": bool, "number": (int, float), "integer": int}
    if "type" in schema and not isinstance(value, kinds[schema["type"]]):
        return False
    if isinstance(value, dict):
        properties = schema.get("properties", {})
        return value.keys() == properties.keys() and all(fits(value[key], properties[key]) for key in value)
    return not isinstance(value, list) or all(fits(item, schema.get("items", {})) for item in value)


class File:
    def __init__(self, data):
        assert data.startswith(MAGIC) and data.endswith(MAGIC), "no MCAP file"
        body = data[len(MAGIC):-len(MAGIC)]
        self.schemas, self.channels, self.messages = {}, {}, collections.defaultdict(list)
        self.chunks = []
        self.all = list(records(body))
        assert self.all[0][0] == HEADER and self.all[-1][0] == FOOTER
        for opcode, content, at in self.all:
            self.read(opcode, Record(content), at + len(MAGIC), len(content))
        self.check_footer(data)

    def read(self, opcode, record, at, size):
        if opcode == SCHEMA:
            number = record.take("H")
            self.schemas[number] = (record.text(), record.text(), json.loads(record.bytes()))
        elif opcode == CHANNEL:
            number, schema = record.take("H"), record.take("H")
            self.channels[number] = (record.text(), record.text(), schema)
        elif opcode == MESSAGE:
            channel, sequence = record.take("H"), record.take("I")
            log_time, _ = record.take("Q"), record.take("Q")
            self.messages[channel].append((sequence, log_time, json.loads(record.rest)))
        elif opcode == CHUNK:
            self.read_chunk(record, at, size)
        elif opcode == STATISTICS:
            self.num_messages = record.take("Q")
            self.num_schemas, self.num_channels = record.take("H"), record.take("I")
            record.take("I"), record.take("I")
            self.num_chunks, self.begin, self.end = record.take("I"), record.take("Q"), record.take("Q")
            self.counts = record.counts("H", "Q")
        elif opcode == CHUNK_INDEX:
            record.take("Q"), record.take("Q")
            where, length = record.take("Q"), record.take("Q")
            assert (where, length) in self.chunks, "an index of a chunk that is not there"

    def read_chunk(self, record, at, size):
        begin, end, uncompressed, crc = record.take("Q"), record.take("Q"), record.take("Q"), record.take("I")
        assert record.text() == "", "compressed: any reader should do"
        inner = record.bytes("Q")
        assert len(inner) == uncompressed and crc in (0, zlib.crc32(inner)), "a chunk's checksum"
        self.chunks.append((at, size + 9))
        before = sum(len(of) for of in self.messages.values())
        for opcode, content, _ in records(inner):
            self.read(opcode, Record(content), None, None)
        assert sum(len(of) for of in self.messages.values()) > before, "an empty chunk"
        times = [time for of in self.messages.values() for _, time, _ in of if begin <= time <= end]
        assert min(times) == begin and max(times) == end, "a chunk's times"

    def check_footer(self, data):
        footer = Record(self.all[-1][1])
        summary, _, crc = footer.take("Q"), footer.take("Q"), footer.take("I")
        assert data[summary] in (SCHEMA, CHANNEL, STATISTICS), "the summary is where the footer says"
        assert crc == zlib.crc32(data[summary:-len(MAGIC) - 4]), "the summary's checksum"

    def topic(self, name):
        (number, (_, encoding, schema)), = [(n, c) for n, c in self.channels.items() if c[0] == name]
        assert encoding == "json" and self.schemas[schema][1] == "jsonschema"
        return self.schemas[schema], self.messages[number]


def main():
    pangea_log, log, to_mcap = sys.argv[1:]
    channels = "(POSE_.*|MAP_STATE|CONSTRAINT|KEYFRAME_1)"
    with tempfile.TemporaryDirectory() as folder:
        out = os.path.join(folder, "session.mcap")
        run = subprocess.run([to_mcap, log, out, channels], check=True, capture_output=True, text=True,
                             env={**os.environ, "PANGEA_LOG": pangea_log})
        assert f"mcap: converts the messages of {log}\n" in run.stderr, "it says what it does"
        with open(out, "rb") as file:
            mcap = File(file.read())

    # The summary says what is there.
    assert mcap.num_messages == sum(len(of) for of in mcap.messages.values())
    assert mcap.counts == {channel: len(of) for channel, of in mcap.messages.items()}
    assert (mcap.num_schemas, mcap.num_channels, mcap.num_chunks) == (len(mcap.schemas), len(mcap.channels), len(mcap.chunks))
    times = [time for of in mcap.messages.values() for _, time, _ in of]
    assert (mcap.begin, mcap.end) == (min(times), max(times))
    for of in mcap.messages.values():
        assert [sequence for sequence, _, _ in of] == list(range(len(of)))

    # It is the log.
    events = [json.loads(line) for line in subprocess.run(
        [pangea_log, "list", log, "--json", "--channels", channels], check=True, capture_output=True, text=True).stdout.splitlines()]
    for channel in sorted({event["channel"] for event in events}):
        _, messages = mcap.topic(channel)
        said = [(event["utime"] * 1000, event["message"]) for event in events if event["channel"] == channel]
        assert [(time, message) for _, time, message in messages] == said, channel
        print(f"{channel}: {len(said)} messages")

    for channel, type_name in (("KEYFRAME_1", "pangea.keyframe_t"), ("POSE_1", "pangea.pose_t")):
        (name, _, schema), messages = mcap.topic(channel)
        assert name == type_name and fits(messages[0][2], schema) and not fits({}, schema), channel
    (name, _, schema), ((_, _, cloud),) = mcap.topic(next(c[0] for c in mcap.channels.values() if c[0].startswith("/points/")))
    assert name == "foxglove.PointCloud" and schema["properties"]["data"]["contentEncoding"] == "base64"
    print(f"{mcap.num_messages} messages of {mcap.num_channels} topics, {mcap.num_chunks} chunks")


if __name__ == "__main__":
    main()
