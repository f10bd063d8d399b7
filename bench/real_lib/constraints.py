"""Accepted constraints of a session's log, with the stamps of both keyframes."""

import struct

from link_lib.metrics import events, keyframes
from real_lib import rotations as rot

HEAD = ">8xq iqi iqi b? i"  # after the type's fingerprint; the last field is the length of the reason


def accepted(log):
    """{(map from, map to): [(seconds, seconds, T_from_to, covariance)]}; a map is (agent, when it was opened). The last message of an id
    counts."""
    stamps = {key: own / 1e6 for key, (_, own, _) in keyframes(log).items()}
    found = {}
    for _, channel, data in events(log):
        if channel == "CONSTRAINT":
            identity, *ends, _, good, reason = struct.unpack_from(HEAD.replace(" ", ""), data)
            values = struct.unpack_from(">43d", data, struct.calcsize(HEAD.replace(" ", "")) + reason)
            covariance = [values[row:row + 6] for row in range(7, 43, 6)]
            found[identity] = (tuple(ends[:3]), tuple(ends[3:6]), good, (rot.normalised(values[:4]), values[4:7]), covariance)
    known = {}
    for a, b, good, T, covariance in found.values():
        if good and a in stamps and b in stamps:
            known.setdefault((a[:2], b[:2]), []).append((stamps[a], stamps[b], T, covariance))
    return known
