"""Poses and anchors in a session's logs. An anchor is identified by (agent, created); a transform is (q, p)."""

import struct
from dataclasses import dataclass

from link_lib.metrics import events
from real_lib import rotations as rot


class Reader:
    """Reads the fields of an LCM message, one after the other."""

    def __init__(self, data):
        self.data, self.at = data, 8  # after the type's fingerprint

    def take(self, form):
        values = struct.unpack_from(">" + form, self.data, self.at)
        self.at += struct.calcsize(">" + form)
        return values

    def text(self):
        size, = self.take("i")
        self.at += size

    def rigid3(self):
        values = self.take("7d")
        return rot.normalised(values[:4]), values[4:]


@dataclass
class Frame:
    """A tracked image, and the anchors shown with it."""

    wall_us: int
    t: float  # seconds, of the image
    map: tuple
    T_odom_body: tuple
    shown: dict  # anchor: T_odom_anchor


def pose(data):
    reader = Reader(data)
    utime, state = reader.take("qb")
    reader.text()
    return utime, state == 2, reader.take("iq"), reader.rigid3()


def shown(data):
    reader = Reader(data)
    _, *map_id, count = reader.take("qiqh")
    return tuple(map_id), {reader.take("iqq")[:2]: reader.rigid3() for _ in range(count)}


def frames(log, agent):
    """The tracked images, in the order of time."""
    found, newest = [], (None, {})
    for wall_us, channel, data in events(log):
        if channel == f"SHOWN_ANCHORS_{agent}":
            newest = shown(data)
        elif channel == f"POSE_{agent}":
            utime, tracking, map_id, T_odom_body = pose(data)
            if tracking:
                found.append(Frame(wall_us, utime / 1e6, map_id, T_odom_body, newest[1] if newest[0] == map_id else {}))
    return found


def first_heard(log, agent):
    """{anchor: T_odom_anchor} of the first pose that the agent received for each anchor."""
    found = {}
    for _, channel, data in events(log):
        if channel == f"ANCHOR_{agent}":
            reader = Reader(data)
            anchor, (_, _, state) = reader.take("iq"), reader.take("qib")
            reader.text(), reader.text(), reader.take("iqiqq")
            if state == 1:
                found.setdefault(anchor, reader.rigid3())
    return found


def placings(log):
    """{anchor: (seconds, T_odom_body)} of each anchor's first edit that an agent's pose placed."""
    found = {}
    for _, channel, data in events(log):
        if channel == "ANCHOR_EDIT":
            reader = Reader(data)
            anchor = reader.take("iq")
            reader.take("qibqb"), reader.text(), reader.text()
            *_, utime = reader.take("biqiq")
            reader.rigid3()
            if reader.take("b")[0]:
                found.setdefault(anchor, (utime / 1e6, reader.rigid3()))
    return found
