import assert from "node:assert/strict";
import { test } from "node:test";
import { saveRecording } from "./save";

const kMembership = { agent: 7, key: "ab".repeat(32), site: "hall", name: "Anna" };

// A dialog that must not be opened twice, and a line of text.
const dialog = {
  open: false, numShown: 0, returnValue: "", close: () => {},
  showModal() {
    if (this.open) throw new DOMException("already open", "InvalidStateError");
    this.open = true;
    ++this.numShown;
  },
  addEventListener(_event: string, listener: () => void) {
    this.close = listener;
  },
  press(value: string) {
    this.open = false;
    this.returnValue = value;
    this.close();
  },
};
const line = { textContent: "" };

class FakeSocket {
  static all: FakeSocket[] = [];
  onclose: ((event: { code: number; reason: string }) => void) | null = null;
  constructor() {
    FakeSocket.all.push(this);
  }
  close() {}
}

const settled = () => new Promise((done) => setTimeout(done, 20));

test("recordings are saved one after the other, because the server takes one at a time of an agent", async () => {
  Object.assign(globalThis, {
    document: { getElementById: (id: string) => (id === "save_dialog" ? dialog : line) },
    location: { protocol: "https:", host: "server" },
    WebSocket: FakeSocket,
  });
  const notices: string[] = [];
  const save = (size: number) => saveRecording(new Blob([new Uint8Array(size)]), "walk", kMembership, (text) => notices.push(text));
  const saved = [save(1_000_000), save(2_000_000)];
  await settled();
  dialog.press("server");
  await settled();
  assert.deepEqual([dialog.numShown, FakeSocket.all.length], [1, 1]);
  FakeSocket.all[0].onclose!({ code: 1006, reason: "" });
  await settled();
  assert.match(line.textContent, /not uploaded: the connection was lost/);
  dialog.press("server");
  await settled();
  FakeSocket.all[1].onclose!({ code: 4200, reason: "one.zip" });
  await settled();
  assert.match(line.textContent, /2\.0 MB/);
  dialog.press("server");
  await settled();
  FakeSocket.all[2].onclose!({ code: 4200, reason: "two.zip" });
  await Promise.all(saved);
  assert.deepEqual(notices, ["The server keeps it as one.zip.", "The server keeps it as two.zip."]);
});
