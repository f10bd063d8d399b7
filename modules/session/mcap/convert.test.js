// The captured sample as MCAP, read again: nothing is lost, and what is drawn is what was said.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import test from "node:test";
import { McapIndexedReader, TempBuffer } from "@mcap/core";
import { convert } from "./convert.js";

const [program, log] = process.env.PANGEA_LOG.split(" ");
const events = execFileSync(program, ["list", log, "--json", "--channels", "(POSE_.*|CORRECTION_.*|MAP_STATE|CONSTRAINT|STATUS_.*)"],
  { encoding: "utf8", maxBuffer: 1 << 28 }).trim().split("\n").map((line) => JSON.parse(line));

const buffer = new TempBuffer();
await convert(events.map((event) => JSON.stringify(event)), buffer);
const reader = await McapIndexedReader.Initialize({ readable: buffer });

async function messagesOf(topic) {
  const messages = [];
  for await (const { logTime, data } of reader.readMessages({ topics: [topic] })) {
    messages.push({ utime: Number(logTime / 1000n), message: JSON.parse(new TextDecoder().decode(data)) });
  }
  return messages;
}

test("every channel is a topic with its messages", async () => {
  const channels = new Set(events.map((event) => event.channel));
  assert.ok(channels.size > 5);
  for (const channel of channels) {
    const said = events.filter((event) => event.channel === channel).map(({ utime, message }) => ({ utime, message }));
    said.sort((a, b) => a.utime - b.utime); // readers give messages by time
    assert.deepEqual(await messagesOf(channel), said, channel);
  }
});

test("poses are drawn in the frame they are in", async () => {
  const tracking = events.filter(({ channel, message }) => channel === "POSE_1" && message.state === 2);
  const poses = await messagesOf("/pose/1");
  assert.equal(poses.length, tracking.length);
  assert.ok(poses.length > 50);
  assert.deepEqual(poses.at(-1).message.pose.position, tracking.at(-1).message.T_map_body.translation);
  // Agent 2 begins in its own map, and is in agent 1's when they are fused.
  const frames = (await messagesOf("/pose/2")).map(({ message }) => message.frame_id);
  assert.match(frames[0], /^map 2\/\d+$/);
  assert.equal(frames.at(-1), poses.at(-1).message.frame_id);
  assert.match(frames.at(-1), /^map 1\/\d+$/);
});

test("the newest state has every keyframe of either agent", async () => {
  const last = events.filter(({ channel }) => channel === "MAP_STATE").at(-1).message;
  for (const agent of [1, 2]) {
    const { poses } = (await messagesOf(`/map/${agent}`)).at(-1).message;
    assert.equal(poses.length, last.keyframes.filter(({ id }) => id.map.agent_id === agent).length);
    assert.ok(poses.length > 20);
  }
});

test("verdicts say why", async () => {
  const verdicts = await messagesOf("/verdicts");
  assert.equal(verdicts.length, events.filter(({ channel }) => channel === "CONSTRAINT").length);
  assert.ok(verdicts.some(({ message }) => message.level === 2 && message.message.endsWith("accepted")));
  assert.ok(verdicts.some(({ message }) => message.level === 3 && message.message.includes("the surroundings contradict")));
});
