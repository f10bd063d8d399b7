"""Reads and writes grey 8-bit PNG files, like those of the simulator, without further packages."""

import struct
import zlib
from itertools import accumulate

SIGNATURE = b"\x89PNG\r\n\x1a\n"


def chunks(data):
    at = len(SIGNATURE)
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        yield kind, data[at + 8:at + 8 + length]
        at += 12 + length


def paeth(a, b, c):
    """The nearest to a + b - c of left, above and above left (PNG specification, 9.4)."""
    left, above, both = abs(b - c), abs(a - c), abs(a + b - 2 * c)
    return a if left <= above and left <= both else b if above <= both else c


def unfiltered(kind, row, above):
    """A row's pixels from the stored bytes (PNG specification, 9.2)."""
    if kind == 0:
        return row
    if kind == 1:
        return bytes(x & 255 for x in accumulate(row))
    if kind == 2:
        return bytes((x + b) & 255 for x, b in zip(row, above))
    out, a, c = bytearray(), 0, 0
    for x, b in zip(row, above):
        a = (x + ((a + b) // 2 if kind == 3 else paeth(a, b, c))) & 255
        out.append(a)
        c = b
    return bytes(out)


def read(path):
    """Width and the pixels, row after row."""
    parts = list(chunks(path.read_bytes()))
    width, height, depth, colour, _, _, interlaced = struct.unpack(">IIBBBBB", parts[0][1])
    if (depth, colour, interlaced) != (8, 0, 0):
        raise ValueError(f"{path}: not a grey 8-bit PNG")
    data = zlib.decompress(b"".join(part for kind, part in parts if kind == b"IDAT"))
    rows, above = [], bytes(width)
    for y in range(height):
        begin = y * (width + 1)
        above = unfiltered(data[begin], data[begin + 1:begin + 1 + width], above)
        rows.append(above)
    return width, b"".join(rows)


def write(path, width, pixels):
    height = len(pixels) // width
    rows = b"".join(b"\0" + pixels[y * width:(y + 1) * width] for y in range(height))
    parts = [(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)), (b"IDAT", zlib.compress(rows, 1)), (b"IEND", b"")]
    path.write_bytes(SIGNATURE + b"".join(
        struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body)) for kind, body in parts))
