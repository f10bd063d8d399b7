import assert from "node:assert/strict";
import { mock, test } from "node:test";
import { proofOf } from "./gateway_link";
import { uploadRecording } from "./upload";

const kMembership = { agent: 7, key: "ab".repeat(32), site: "hall", name: "Anna" };

// A fake WebSocket; the test plays the server.
class FakeSocket {
  static readonly OPEN = 1;
  static last: FakeSocket;
  readyState = FakeSocket.OPEN;
  sent: Uint8Array[] = [];
  onmessage: ((event: { data: ArrayBuffer }) => void) | null = null;
  onclose: ((event: { code: number; reason: string }) => void) | null = null;
  constructor(readonly url: string) {
    FakeSocket.last = this;
  }
  send(message: Uint8Array | ArrayBuffer) {
    this.sent.push(new Uint8Array(message));
  }
  close() {
    this.readyState = 3;
  }
  says(message: Uint8Array<ArrayBuffer>) {
    this.onmessage?.({ data: message.buffer });
  }
  takes(bytes: number) {
    this.says(new Uint8Array(new BigUint64Array([BigInt(bytes)]).buffer));
  }
  ends(code: number, reason: string) {
    this.readyState = 3;
    this.onclose?.({ code, reason });
  }
}

const settled = () => new Promise((done) => setTimeout(done, 20));

// A busy machine takes longer.
async function becomes(isSo: () => boolean) {
  for (let i = 0; i < 250 && !isSo(); ++i) await settled();
  await settled();
}

async function withSocket(run: () => Promise<void>) {
  const realSocket = globalThis.WebSocket;
  globalThis.WebSocket = FakeSocket as unknown as typeof WebSocket;
  await run().finally(() => (globalThis.WebSocket = realSocket));
}

test("a recording goes up no faster than the server takes it", () => withSocket(async () => {
  const content = new Uint8Array(1_500_000).map((_, i) => i % 251);
  const shares: number[] = [];
  const kept = uploadRecording("wss://server", kMembership, new Blob([content]), (share) => shares.push(share));
  const socket = FakeSocket.last;
  assert.equal(socket.url, "wss://server/recording?agent=7");
  const nonce = new Uint8Array(32).fill(5);
  socket.says(nonce);
  await becomes(() => socket.sent.length === 2);
  const [proof, size] = socket.sent.splice(0);
  assert.deepEqual(proof, await proofOf(kMembership.key, 7, nonce));
  assert.equal(new DataView(size.buffer).getBigUint64(0, true), 1_500_000n);

  const sentBytes = () => socket.sent.reduce((sum, { length }) => sum + length, 0);
  socket.takes(0);
  await becomes(() => sentBytes() >= 1_000_000);
  assert.equal(sentBytes(), 1_000_000);
  socket.takes(300_000);
  await becomes(() => sentBytes() >= 1_300_000);
  assert.equal(sentBytes(), 1_300_000);
  socket.takes(1_000_000);
  await becomes(() => sentBytes() >= 1_500_000);
  assert.deepEqual(Buffer.concat(socket.sent), Buffer.from(content));
  assert.ok(socket.sent.every(({ length }) => length <= 64_000));
  assert.deepEqual(shares, [0, 0.2, 2 / 3]);
  socket.ends(4200, "walk.zip");
  assert.equal(await kept, "walk.zip");
}));

test("what the server says against it is the visitor's to read", () => withSocket(async () => {
  const refused = uploadRecording("wss://server", kMembership, new Blob(["zip"]), () => {});
  FakeSocket.last.ends(4413, "the server has no room for more recordings");
  await assert.rejects(refused, /no room/);
  const lost = uploadRecording("wss://server", kMembership, new Blob(["zip"]), () => {});
  FakeSocket.last.ends(1006, "");
  await assert.rejects(lost, /connection was lost/);
}));

test("a server that says nothing for a minute is lost", () => withSocket(async () => {
  mock.timers.enable({ apis: ["setTimeout"] });
  let said = "";
  const lost = uploadRecording("wss://server", kMembership, new Blob(["zip"]), () => {}).catch((error) => (said = error.message));
  mock.timers.tick(59_000);
  FakeSocket.last.says(new Uint8Array(32));
  mock.timers.tick(59_000);
  await new Promise((done) => setImmediate(done));
  assert.equal(said, "");
  mock.timers.tick(1_000);
  await lost;
  assert.equal(said, "the connection was lost");
  assert.equal(FakeSocket.last.readyState, 3);
  mock.timers.reset();
}));
