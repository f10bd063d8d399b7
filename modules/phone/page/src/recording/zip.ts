// Reads files of a zip one at a time. A recording's zip is often larger than what a browser reads into memory at once (2 GB).

import { inflateSync } from "fflate";
import type { Files } from "./files";

// The zip format's structures: signatures, and sizes without their variable ends (APPNOTE.TXT 6.3.10, section 4.3).
const kEnd = { signature: 0x06054b50, bytes: 22 };
const kEnd64 = { signature: 0x06064b50, bytes: 56 };
const kLocator64 = { signature: 0x07064b50, bytes: 20 };
const kEntry = { signature: 0x02014b50, bytes: 46 };
const kLocal = { signature: 0x04034b50, bytes: 30 };
const kMaxComment = 65_535;
const kIs64 = 0xffffffff; // a size or offset with this value is in the zip64 structure instead
const kExtra64 = 1;
const kStored = 0;
const kDeflated = 8;

interface Entry {
  method: number;
  isEncrypted: boolean;
  packedBytes: number;
  bytes: number;
  offset: number; // of its local header
}

export async function filesOfZip(zip: Blob): Promise<Files> {
  const entries = await entriesOf(zip).catch((error: Error) => {
    throw new Error(`this zip cannot be read: ${error.message}`);
  });
  return {
    names: [...entries.keys()],
    read: async (name) => {
      const entry = entries.get(name);
      if (!entry) throw new Error(`${name} is not in the zip`);
      return unpack(zip, entry).catch((error: Error) => {
        throw new Error(`${name} cannot be unpacked: ${error.message}`);
      });
    },
  };
}

async function viewOf(zip: Blob, begin: number, bytes: number): Promise<DataView<ArrayBuffer>> {
  const piece = await zip.slice(begin, begin + bytes).arrayBuffer();
  if (piece.byteLength < bytes) throw new Error("it is cut off");
  return new DataView(piece);
}

const uint64 = (view: DataView, at: number) => Number(view.getBigUint64(at, true));

async function entriesOf(zip: Blob): Promise<Map<string, Entry>> {
  const { begin, bytes } = await directoryOf(zip);
  const directory = await viewOf(zip, begin, bytes);
  const entries = new Map<string, Entry>();
  for (let at = 0; at < bytes; ) {
    if (directory.getUint32(at, true) !== kEntry.signature) throw new Error("its list of files is damaged");
    const [nameBytes, extraBytes, commentBytes] = [28, 30, 32].map((field) => directory.getUint16(at + field, true));
    const extraAt = at + kEntry.bytes + nameBytes;
    const name = new TextDecoder().decode(new Uint8Array(directory.buffer, at + kEntry.bytes, nameBytes));
    entries.set(name, entryAt(directory, at, new DataView(directory.buffer, extraAt, extraBytes)));
    at = extraAt + extraBytes + commentBytes;
  }
  return entries;
}

async function directoryOf(zip: Blob): Promise<{ begin: number; bytes: number }> {
  const from = Math.max(0, zip.size - kEnd.bytes - kMaxComment);
  const tail = await viewOf(zip, from, zip.size - from);
  let at = tail.byteLength - kEnd.bytes;
  while (at >= 0 && tail.getUint32(at, true) !== kEnd.signature) --at;
  if (at < 0) throw new Error("it has no end");
  const locator = at - kLocator64.bytes;
  if (locator >= 0 && tail.getUint32(locator, true) === kLocator64.signature) {
    const end = await viewOf(zip, uint64(tail, locator + 8), kEnd64.bytes);
    if (end.getUint32(0, true) !== kEnd64.signature) throw new Error("its end is damaged");
    return { begin: uint64(end, 48), bytes: uint64(end, 40) };
  }
  return { begin: tail.getUint32(at + 16, true), bytes: tail.getUint32(at + 12, true) };
}

// `extra`: the entry's further fields, of which one may have its large numbers, in this order.
function entryAt(directory: DataView, at: number, extra: DataView): Entry {
  let next64 = extra.byteLength;
  for (let field = 0; field + 4 <= extra.byteLength; field += 4 + extra.getUint16(field + 2, true)) {
    if (extra.getUint16(field, true) === kExtra64) next64 = field + 4;
  }
  const [bytes, packedBytes, offset] = [24, 20, 42].map((field) => {
    const value = directory.getUint32(at + field, true);
    return value === kIs64 ? uint64(extra, (next64 += 8) - 8) : value;
  });
  return { method: directory.getUint16(at + 10, true), isEncrypted: (directory.getUint16(at + 8, true) & 1) === 1, packedBytes, bytes, offset };
}

async function unpack(zip: Blob, { method, isEncrypted, packedBytes, bytes, offset }: Entry): Promise<Uint8Array> {
  const header = await viewOf(zip, offset, kLocal.bytes);
  if (header.getUint32(0, true) !== kLocal.signature) throw new Error("it is damaged");
  const begin = offset + kLocal.bytes + header.getUint16(26, true) + header.getUint16(28, true);
  const packed = new Uint8Array((await viewOf(zip, begin, packedBytes)).buffer);
  if (isEncrypted || (method !== kStored && method !== kDeflated)) throw new Error("only stored and deflated files can be");
  return method === kStored ? packed : inflateSync(packed, { out: new Uint8Array(bytes) });
}
