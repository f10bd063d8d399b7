import assert from "node:assert/strict";
import { createHmac } from "node:crypto";
import { test } from "node:test";
import { proofOf } from "./gateway_link";
import { codeIn, parseMembership } from "./join";

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
  for (const bad of [null, "", "no json", "null", JSON.stringify({ ...good, agent: 0 }), JSON.stringify({ ...good, key: "ab" })]) {
    assert.equal(parseMembership(bad), undefined);
  }
});
