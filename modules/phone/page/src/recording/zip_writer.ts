// Writes a zip of files that are stored as they are. Its list of files is written along with them, so finishing takes no time, however
// many files there are. The pieces are blobs, which the browser may keep on its disk.

const kFilesPart_bytes = 4_000_000;
const kListPart_bytes = 64_000;

// The zip format's structures: signatures and sizes (APPNOTE.TXT 6.3.10, section 4.3).
const kLocal = { signature: 0x04034b50, bytes: 30 };
const kEntry = { signature: 0x02014b50, bytes: 46 };
const kEnd = { signature: 0x06054b50, bytes: 22 };
const kVersion = 20;
const kUtf8 = 1 << 11; // the names

type Bytes = Uint8Array<ArrayBuffer>;

class Pieces {
  bytes = 0;
  private readonly parts: Blob[] = [];
  private recent: Bytes[] = [];
  private recentBytes = 0;

  constructor(private readonly partBytes: number) {}

  add(data: Bytes) {
    this.recent.push(data);
    this.bytes += data.length;
    this.recentBytes += data.length;
    if (this.recentBytes < this.partBytes) return;
    this.parts.push(new Blob(this.recent));
    this.recent = [];
    this.recentBytes = 0;
  }

  get all(): BlobPart[] {
    return [...this.parts, ...this.recent];
  }
}

export class ZipWriter {
  private readonly files = new Pieces(kFilesPart_bytes);
  private readonly list = new Pieces(kListPart_bytes);
  private numFiles = 0;

  get bytes(): number {
    return this.files.bytes + this.list.bytes;
  }

  // At most 65,535 files and 4 GiB.
  add(name: string, content: Uint8Array) {
    this.append(name, [content], crcOf(content));
  }

  // Adds a file slice by slice; in between, the browser does other things.
  async addSlices(name: string, slices: Iterable<Uint8Array>) {
    const all: Uint8Array[] = [];
    let crc = 0;
    for (const slice of slices) {
      all.push(slice);
      crc = crcOf(slice, crc);
      await new Promise((done) => setTimeout(done));
    }
    this.append(name, all, crc);
  }

  // Nothing can be added afterwards.
  finish(): Blob {
    const [bytes, offset] = [this.list.bytes, this.files.bytes];
    const end = [0, 0, this.numFiles, this.numFiles, bytes & 0xffff, bytes >>> 16, offset & 0xffff, offset >>> 16, 0];
    return new Blob([...this.files.all, ...this.list.all, structure(kEnd, end)], { type: "application/zip" });
  }

  private append(name: string, slices: Uint8Array[], crc: number) {
    const nameBytes = new TextEncoder().encode(name);
    const size = slices.reduce((sum, { length }) => sum + length, 0);
    const [time, day] = dosTime(new Date());
    const header = [kVersion, kUtf8, 0, time, day, crc & 0xffff, crc >>> 16, size & 0xffff, size >>> 16, size & 0xffff, size >>> 16, nameBytes.length, 0];
    const offset = this.files.bytes;
    this.files.add(structure(kLocal, header, nameBytes));
    for (const slice of slices) this.files.add(slice as Bytes);
    this.list.add(structure(kEntry, [kVersion, ...header, 0, 0, 0, 0, 0, offset & 0xffff, offset >>> 16], nameBytes));
    ++this.numFiles;
  }
}

// A structure: its signature, its fields of 16 bits, and the name.
function structure({ signature, bytes }: typeof kLocal, fields: number[], name: Uint8Array = new Uint8Array()): Bytes {
  const all = new Uint8Array(bytes + name.length);
  const view = new DataView(all.buffer);
  view.setUint32(0, signature, true);
  fields.forEach((field, i) => view.setUint16(4 + 2 * i, field, true));
  all.set(name, bytes);
  return all;
}

function dosTime(date: Date): [number, number] {
  return [
    (date.getHours() << 11) | (date.getMinutes() << 5) | (date.getSeconds() >> 1),
    ((date.getFullYear() - 1980) << 9) | ((date.getMonth() + 1) << 5) | date.getDate(),
  ];
}

const kCrcTable = Int32Array.from({ length: 256 }, (_, byte) => {
  let crc = byte;
  for (let bit = 0; bit < 8; ++bit) crc = (crc & 1 ? 0xedb88320 : 0) ^ (crc >>> 1);
  return crc;
});

// `before`: of the content before these bytes.
function crcOf(bytes: Uint8Array, before = 0): number {
  let crc = ~before;
  for (let i = 0; i < bytes.length; ++i) crc = kCrcTable[(crc ^ bytes[i]) & 255] ^ (crc >>> 8);
  return ~crc;
}
