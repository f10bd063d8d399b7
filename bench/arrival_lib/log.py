"""Events of LCM logs."""

import struct
from dataclasses import dataclass, replace
from pathlib import Path

SYNC = 0xEDA1DA01
HEADER = struct.Struct(">IqqII")  # sync word, number, utime, lengths of channel and data


@dataclass(frozen=True)
class Event:
    utime: int
    channel: str
    data: bytes

    def at(self, utime):
        return replace(self, utime=utime)


def read(path):
    """Reads the events of an undamaged log."""
    data, at, events = Path(path).read_bytes(), 0, []
    while at < len(data):
        sync, _, utime, channel_size, data_size = HEADER.unpack_from(data, at)
        if sync != SYNC:
            raise ValueError(f"{path}: no event at byte {at}; pangea-log cut reads damaged logs")
        at += HEADER.size
        channel = data[at:at + channel_size].decode()
        at += channel_size
        events.append(Event(utime, channel, data[at:at + data_size]))
        at += data_size
    return events


def write(path, events):
    """Writes the events in order of time."""
    with Path(path).open("wb") as out:
        for number, event in enumerate(sorted(events, key=lambda event: event.utime)):
            channel = event.channel.encode()
            out.write(HEADER.pack(SYNC, number, event.utime, len(channel), len(event.data)) + channel + event.data)
