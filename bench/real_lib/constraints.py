"""Accepted constraints of a session's log, with the stamps of both keyframes."""

import struct

from link_lib.metrics import events, keyframes
from real_lib import rotations as rot

HEAD = ">8xq iqi iqi b? i"  # after the type's fingerprint; the last field is the length of the reason


def accepted(log):
    """{(agent from, agent to): [(seconds, seconds, T_from_to)]}; the last message of an id counts."""
    stamps = {key: own / 1e6 for key, (_, own, _) in keyframes(log).items()}
    found = {}
    for _, channel, data in events(log):
        if channel == "CONSTRAINT":
            identity, *ends, _, good, reason = struct.unpack_from(HEAD.replace(" ", ""), data)
            pose = struct.unpack_from(">7d", data, struct.calcsize(HEAD.replace(" ", "")) + reason)
            found[identity] = (tuple(ends[:3]), tuple(ends[3:6]), good, (rot.normalised(pose[:4]), pose[4:]))
    known = {}
    for a, b, good, T in found.values():
        if good and a in stamps and b in stamps:
            known.setdefault((a[0], b[0]), []).append((stamps[a], stamps[b], T))
    return known
