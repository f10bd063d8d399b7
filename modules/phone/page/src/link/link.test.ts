import assert from "node:assert/strict";
import { createHmac } from "node:crypto";
import { mock, test } from "node:test";
import { GatewayLink, proofOf } from "./gateway_link";
import { codeIn, join, parseMembership } from "./join";

test("the proof is what the gateway computes", async () => {
  const nonce = new Uint8Array(32).map((_, i) => 7 * i);
  const key = "0123456789abcdef".repeat(4);
  const expected = createHmac("sha256", Buffer.from(key, "hex")).update("pangea-gateway-v1:7:").update(nonce).digest("hex");
  assert.equal(Buffer.from(await proofOf(key, 7, nonce)).toString("hex"), expected);
});

test("the code is in the fragment, or there is none", () => {
  assert.equal(codeIn("#join=ABCD-EFGH"), "ABCD-EFGH");
  assert.equal(codeIn("#"), undefined);
  assert.equal(codeIn(""), undefined);
});

test("storage that somebody else wrote is no membership", () => {
  const good = { agent: 7, key: "ab".repeat(32), site: "hall", name: "Anna" };
  assert.deepEqual(parseMembership(JSON.stringify(good)), good);
  for (const bad of [undefined, "", "no json", "null", JSON.stringify({ ...good, agent: 0 }), JSON.stringify({ ...good, key: "ab" })]) {
    assert.equal(parseMembership(bad), undefined);
  }
});

test("a server that cannot be reached is named, and not the browser's words", async () => {
  const { fetch } = globalThis;
  globalThis.fetch = async () => {
    throw new TypeError("Failed to fetch");
  };
  await assert.rejects(join("ABCD-EFGH", "Anna"), /server cannot be reached/).finally(() => (globalThis.fetch = fetch));
});

// A fake WebSocket; the test plays the server.
class FakeSocket {
  static readonly OPEN = 1;
  static all: FakeSocket[] = [];
  readyState = FakeSocket.OPEN;
  bufferedAmount = 0;
  sent: Uint8Array[] = [];
  onmessage: ((event: { data: ArrayBuffer }) => void) | null = null;
  onclose: ((event: { code: number }) => void) | null = null;
  constructor() {
    FakeSocket.all.push(this);
  }
  send(packet: Uint8Array) {
    this.sent.push(packet);
  }
  close() {}
  says(length: number) {
    this.onmessage?.({ data: new ArrayBuffer(length) });
  }
}

test("a socket that says nothing for ten seconds is given up for a new one", async () => {
  const realSocket = globalThis.WebSocket;
  globalThis.WebSocket = FakeSocket as unknown as typeof WebSocket;
  mock.timers.enable({ apis: ["setTimeout"] });
  const packets: number[] = [];
  const link = new GatewayLink("wss://server", 7, "ab".repeat(32), ({ length }) => packets.push(length));
  const [socket] = FakeSocket.all;
  socket.says(32);
  while (link.state !== "open") await new Promise((done) => setImmediate(done));
  mock.timers.tick(9_000);
  socket.says(100);
  mock.timers.tick(9_000);
  assert.deepEqual([link.state, packets], ["open", [100]]);
  assert.ok(link.send(new Uint8Array(5)));
  const { length } = socket.sent;
  socket.readyState = 2; // it is closing
  assert.ok(!link.send(new Uint8Array(5)));
  assert.equal(socket.sent.length, length);
  mock.timers.tick(1_000);
  assert.equal(link.state, "connecting");
  socket.says(50); // too late: it must be ignored
  mock.timers.tick(1_000);
  assert.deepEqual([FakeSocket.all.length, packets], [2, [100]]);
  mock.timers.tick(10_000); // the second socket gets no answer either
  mock.timers.tick(2_000);
  assert.equal(FakeSocket.all.length, 3);
  mock.timers.reset();
  globalThis.WebSocket = realSocket;
});

test("a closed link opens no further socket and gives no packet", () => {
  const realSocket = globalThis.WebSocket;
  globalThis.WebSocket = FakeSocket as unknown as typeof WebSocket;
  mock.timers.enable({ apis: ["setTimeout"] });
  for (const isLost of [false, true]) {
    FakeSocket.all = [];
    const link = new GatewayLink("wss://server", 7, "ab".repeat(32), () => assert.fail("a packet"));
    const [socket] = FakeSocket.all;
    if (isLost) socket.onclose!({ code: 1006 });
    link.close();
    socket.says(32);
    socket.says(50);
    mock.timers.tick(60_000);
    assert.equal(FakeSocket.all.length, 1);
  }
  mock.timers.reset();
  globalThis.WebSocket = realSocket;
});
