import assert from "node:assert/strict";
import { test } from "node:test";
import { strToU8, zipSync } from "fflate";
import { filesOfZip } from "./zip";

const kText = "a row of numbers\n".repeat(1000);
const zipped = () => zipSync({ "walk/data.csv": strToU8(kText), "walk/a.png": [strToU8("pixels"), { level: 0 }], "walk/empty": new Uint8Array() });
const textOf = async (zip: Blob, name: string) => new TextDecoder().decode(await (await filesOfZip(zip)).read(name));

// As browsers treat a file of more than 2 GB.
class LargeFile extends Blob {
  async arrayBuffer(): Promise<ArrayBuffer> {
    throw new DOMException("could not be read", "NotReadableError");
  }
}

test("a zip is read file by file, as one of more than 2 GB must be", async () => {
  const zip = new LargeFile([zipped()]);
  assert.deepEqual((await filesOfZip(zip)).names, ["walk/data.csv", "walk/a.png", "walk/empty"]);
  assert.equal(await textOf(zip, "walk/data.csv"), kText);
  assert.equal(await textOf(zip, "walk/a.png"), "pixels");
  assert.equal(await textOf(zip, "walk/empty"), "");
  await assert.rejects(textOf(zip, "walk/b.png"), /walk\/b\.png is not in the zip/);
});

// The same zip with the structures of zip64, which large zips have.
function as64(bytes: Uint8Array): Blob {
  const end = bytes.length - 22;
  const old = new DataView(bytes.buffer, bytes.byteOffset);
  const [directoryBytes, directoryAt] = [old.getUint32(end + 12, true), old.getUint32(end + 16, true)];
  const end64 = new DataView(new ArrayBuffer(56));
  end64.setUint32(0, 0x06064b50, true);
  end64.setBigUint64(40, BigInt(directoryBytes), true);
  end64.setBigUint64(48, BigInt(directoryAt), true);
  const locator = new DataView(new ArrayBuffer(20));
  locator.setUint32(0, 0x07064b50, true);
  locator.setBigUint64(8, BigInt(end), true);
  const newEnd = new Uint8Array(bytes.slice(end)).fill(0xff, 12, 20);
  return new Blob([bytes.slice(0, end), end64.buffer, locator.buffer, newEnd]);
}

test("a zip64 is read too, also with a comment at its end", async () => {
  assert.equal(await textOf(as64(zipped()), "walk/data.csv"), kText);
  assert.equal(await textOf(new Blob([zipped(), "as a comment"]), "walk/a.png"), "pixels");
});

test("what is wrong with a zip is named", async () => {
  const damaged = (at: number, byte: number) => {
    const bytes = zipped();
    bytes[at < 0 ? bytes.length + at : at] = byte;
    return new Blob([bytes]);
  };
  await assert.rejects(filesOfZip(new Blob(["no zip"])), /this zip cannot be read: it has no end/);
  await assert.rejects(filesOfZip(new Blob([zipped().slice(0, -30)])), /this zip cannot be read: it has no end/);
  await assert.rejects(filesOfZip(damaged(-6, 0)), /this zip cannot be read/); // another offset of the list
  await assert.rejects(textOf(damaged(0, 0), "walk/data.csv"), /walk\/data\.csv cannot be unpacked: it is damaged/);
  const method = zipped().findIndex((byte, i, all) => byte === 1 && all[i - 1] === 0x4b && all[i - 2] === 0x50 && all[i + 1] === 2) + 8;
  await assert.rejects(textOf(damaged(method, 9), "walk/data.csv"), /only stored and deflated files/);
});
