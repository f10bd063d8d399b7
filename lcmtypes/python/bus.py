"""A bus of Pangea (an LCM multicast bus, udpm://) in plain Python 3: publish, subscribe, handle.

    from pangea import pose_t
    from pangea.bus import Bus

    bus = Bus()
    bus.subscribe("POSE_[0-9]+", lambda channel, pose: print(channel, pose.utime), pose_t)
    while True:
        bus.handle(1.0)

docs/bus.md lists channels, types and rates. handle() calls the handlers in the thread of its
caller; only one thread may use a Bus. As in the C++ programs, a bus with ttl=0 drops all messages
from other hosts.
"""

import collections
import ctypes
import errno
import itertools
import re
import select
import socket
import struct
import sys
import time
import urllib.parse

from . import image_t

_BUFFER_BYTES = 4 << 20  # if the URL gives no size; with the kernel's 200 kB bursts are lost
DEFAULT_URL = f"udpm://239.255.76.67:7667?ttl=0&recv_buf_size={_BUFFER_BYTES}"

_SHORT, _FRAGMENT = 0x4C433032, 0x4C433033  # "LC02", "LC03"
_MAX_SHORT = 65499  # channel, 0, data: LCM sends up to this many bytes as one datagram
_MAX_FRAGMENT = 65487
_MAX_CHANNEL = 63
_MAX_MESSAGE = 16 << 20
_MAX_PARTIALS = 100  # messages that lack fragments; beyond that the oldest is dropped
_MAX_IMAGE_CHUNK = 29000


class Bus:
    """Throws ValueError for a bad URL and OSError for a network without multicast."""

    def __init__(self, url=DEFAULT_URL):
        self._group, self._port, ttl, buffer_bytes = _parse(url)
        self._number = itertools.count()
        self._subscriptions = []
        self._partials = collections.OrderedDict()  # (sender, number): {fragment number: (offset, bytes)}
        self.refused = collections.Counter()  # number of dropped datagrams and messages, by reason
        try:
            self._sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            self._sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, ttl)
            self._sender.connect((self._group, self._port))
            self._receiver = _receiving_socket(self._group, self._port, buffer_bytes, host_only=ttl == 0)
        except OSError as error:
            if error.errno not in (errno.ENETUNREACH, errno.ENODEV):
                raise
            raise OSError(error.errno, f"cannot open the bus '{url}': this machine has no multicast route "
                                       "(ip route add 224.0.0.0/4 dev lo)") from error

    def publish(self, channel, message):
        """Sends a message of the package pangea, or the bytes of an encoded one."""
        data = bytes(message) if isinstance(message, (bytes, bytearray, memoryview)) else message.encode()
        name = channel.encode()
        if not 0 < len(name) <= _MAX_CHANNEL:
            raise ValueError(f"channel '{channel}': give 1 to {_MAX_CHANNEL} characters")
        number = next(self._number) & 0xFFFFFFFF
        payload = name + b"\0" + data
        if len(payload) <= _MAX_SHORT:
            self._sender.send(struct.pack(">II", _SHORT, number) + payload)
            return
        count = -(-len(payload) // _MAX_FRAGMENT)
        for i in range(count):
            piece = payload[i * _MAX_FRAGMENT:(i + 1) * _MAX_FRAGMENT]
            offset = max(0, i * _MAX_FRAGMENT - len(name) - 1)  # in the data; fragment 0 begins with the channel
            self._sender.send(struct.pack(">IIIIHH", _FRAGMENT, number, len(data), offset, i, count) + piece)

    def subscribe(self, channels, handler, message_type=None):
        """Calls handler(channel, message) for each message whose full channel matches `channels`.

        `channels` is a regular expression. With a message_type the message is decoded, or counted
        in `refused` if that fails; without one the handler gets the bytes.
        """
        self._subscriptions.append((re.compile(channels), handler, message_type))

    def handle(self, timeout_s=None):
        """Waits for one message with a subscription and calls its handlers.

        Returns False if none came within timeout_s; None waits without limit.
        """
        deadline = None if timeout_s is None else time.monotonic() + timeout_s
        while True:
            left = None if deadline is None else max(0.0, deadline - time.monotonic())
            if not select.select([self._receiver], [], [], left)[0]:
                return False
            datagram, sender = self._receiver.recvfrom(1 << 16)
            message = self._assemble(datagram, sender)
            if message is not None and self._deliver(*message):
                return True

    def fileno(self):
        """The receiving socket's file descriptor, for select and similar functions."""
        return self._receiver.fileno()

    def close(self):
        self._sender.close()
        self._receiver.close()

    def _deliver(self, channel, data):
        delivered = False
        for channels, handler, message_type in self._subscriptions:
            if not channels.fullmatch(channel):
                continue
            message = data
            if message_type is not None:
                try:
                    message = message_type.decode(data)
                except (ValueError, struct.error):
                    self.refused[f"{channel}: no {message_type.__name__}"] += 1
                    continue
            handler(channel, message)
            delivered = True
        return delivered

    def _assemble(self, datagram, sender):
        """(channel, data) if the datagram is a message or completes one, else None."""
        magic = int.from_bytes(datagram[:4], "big")
        if magic == _SHORT and len(datagram) > 8:
            return self._split(datagram[8:])
        if magic == _FRAGMENT and len(datagram) > 20:
            return self._join(sender, datagram)
        self.refused["datagram: not of LCM"] += 1
        return None

    def _split(self, payload):
        name, end, data = payload.partition(b"\0")
        if not end or not 0 < len(name) <= _MAX_CHANNEL or not name.isascii():
            self.refused["datagram: no channel of 1 to 63 characters"] += 1
            return None
        return name.decode(), data

    def _join(self, sender, datagram):
        number, total, _, index, count = struct.unpack(">IIIHH", datagram[4:20])
        if index >= count or total > _MAX_MESSAGE:
            self.refused["fragment: number or size out of range"] += 1
            return None
        pieces = self._partials.setdefault((sender, number), {})
        pieces[index] = datagram[20:]
        if len(pieces) < count:
            while len(self._partials) > _MAX_PARTIALS:
                self._partials.popitem(last=False)
                self.refused["message that lacked fragments"] += 1
            return None
        del self._partials[(sender, number)]
        message = self._split(b"".join(pieces.get(i, b"") for i in range(count)))
        if message is not None and len(message[1]) != total:
            self.refused["fragments that do not fit each other"] += 1
            return None
        return message


def image_chunks(utime, png, width, height):
    """Yields the messages of one image for IMAGE_k. `png`: a PNG or JPEG file, `utime`: microseconds."""
    pieces = [png[i:i + _MAX_IMAGE_CHUNK] for i in range(0, len(png), _MAX_IMAGE_CHUNK)]
    for i, piece in enumerate(pieces):
        chunk = image_t()
        chunk.utime, chunk.encoding, chunk.width, chunk.height = utime, image_t.ENCODING_PNG, width, height
        chunk.chunk, chunk.num_chunks, chunk.total_bytes = i, len(pieces), len(png)
        chunk.offset_bytes, chunk.num_bytes, chunk.data = i * _MAX_IMAGE_CHUNK, len(piece), piece
        yield chunk


def _parse(url):
    """(group, port, ttl, receive buffer in bytes)"""
    parts = urllib.parse.urlsplit(url)
    try:
        arguments = dict(urllib.parse.parse_qsl(parts.query, strict_parsing=bool(parts.query)))
        group, port = parts.hostname or "239.255.76.67", parts.port or 7667
        is_multicast = 224 <= socket.inet_aton(group)[0] < 240
        if parts.scheme != "udpm" or not is_multicast:
            raise ValueError
        return group, port, int(arguments.get("ttl", 0)), int(arguments.get("recv_buf_size", _BUFFER_BYTES))
    except (ValueError, OSError):
        raise ValueError(f"cannot open the bus '{url}': give udpm://GROUP:PORT?ttl=N, as {DEFAULT_URL}") from None


def _receiving_socket(group, port, buffer_bytes, host_only):
    receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    if host_only:
        _keep_to_this_host(receiver)
    receiver.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    if buffer_bytes:
        receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, buffer_bytes)
        given = receiver.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF) // 2  # the rest is the kernel's own
        if given < buffer_bytes:
            print(f"bus: the kernel gives a receive buffer of {given // 1000} kB, not {buffer_bytes // 1000} kB: bursts are lost; "
                  f"sysctl -w net.core.rmem_max={buffer_bytes}", file=sys.stderr)
    ip_multicast_all = 49  # else it would also receive what is sent to other groups on this port
    receiver.setsockopt(socket.IPPROTO_IP, ip_multicast_all, 0)
    receiver.bind(("", port))
    receiver.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton(group) + b"\0\0\0\0")
    return receiver


def _keep_to_this_host(receiver):
    """Drops packets of other hosts, with the filter of modules/bus/transport/udpm_socket.cc."""
    so_attach_filter, note, load, equal, give = 26, 0xFFFFF000, 0x20, 0x15, 0x06
    code = [(load, 0, 0, note + 8), (equal, 2, 0, socket.if_nametoindex("lo")),  # the interface
            (load, 0, 0, note + 4), (equal, 0, 1, 5),  # PACKET_LOOPBACK
            (give, 0, 0, 0xFFFFFFFF), (give, 0, 0, 0)]
    program = ctypes.create_string_buffer(b"".join(struct.pack("HBBI", *step) for step in code))
    receiver.setsockopt(socket.SOL_SOCKET, so_attach_filter, struct.pack("HP", len(code), ctypes.addressof(program)))
