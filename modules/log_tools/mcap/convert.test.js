// The captured sample as MCAP, read again: nothing is lost, what is drawn is what was said, and what Foxglove knows by its name
// has Foxglove's own fields.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { Readable } from "node:stream";
import test from "node:test";
import { setTimeout } from "node:timers/promises";
import { McapIndexedReader, TempBuffer } from "@mcap/core";
import Ajv from "ajv";
import { convert, linesOf, wellKnown } from "./convert.js";
import { Drawn } from "./drawn.js";

const [program, log] = process.env.PANGEA_LOG.split(" ");
const events = execFileSync(program, ["list", log, "--json", "--channels", "(POSE_.*|CORRECTION_.*|MAP_STATE|CONSTRAINT|STATUS_.*)"],
  { encoding: "utf8", maxBuffer: 1 << 28 }).trim().split("\n").map((line) => JSON.parse(line));

const kPly = `ply
format ascii 1.0
comment map frame: odom of map 1/5, metres, z up
element vertex 2
end_header
1.5 -2.25 3 0 114 178
4 5 6 213 94 0
`;

const buffer = new TempBuffer();
await convert(events.map((event) => JSON.stringify(event)), buffer, [kPly]);
const reader = await McapIndexedReader.Initialize({ readable: buffer });

async function collected(iterable) {
  const all = [];
  for await (const one of iterable) {
    all.push(one);
  }
  return all;
}

async function messagesOf(topic) {
  const messages = [];
  for await (const { logTime, data } of reader.readMessages({ topics: [topic] })) {
    messages.push({ utime: Number(logTime / 1000n), message: JSON.parse(new TextDecoder().decode(data)) });
  }
  return messages;
}

test("lines wait for whoever reads them later", async () => {
  const lines = linesOf(Readable.from(["first\nsecond\n", "third\n"]));
  await setTimeout(20);
  assert.deepEqual(await collected(lines), ["first", "second", "third"]);
});

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

test("verification results say why", async () => {
  const results = await messagesOf("/verification_results");
  assert.equal(results.length, events.filter(({ channel }) => channel === "CONSTRAINT").length);
  assert.ok(results.some(({ message }) => message.level === 2 && message.message.endsWith("accepted")));
  assert.ok(results.some(({ message }) => message.level === 3 && message.message.includes("the surroundings contradict")));
});

test("what Foxglove knows has the fields that its schemas want, and no others", async () => {
  const ajv = new Ajv({ strict: false, validateFormats: false });
  const checks = new Map();
  for (const { name, data } of reader.schemasById.values()) {
    if (!name.startsWith("foxglove.")) continue;
    const schema = JSON.parse(new TextDecoder().decode(data));
    assert.deepEqual(schema, wellKnown(name));
    checks.set(name, { fields: Object.keys(schema.properties).sort(), valid: ajv.compile(schema), seen: 0 });
  }
  for await (const { channelId, data } of reader.readMessages()) {
    const { name } = reader.schemasById.get(reader.channelsById.get(channelId).schemaId);
    const check = checks.get(name);
    if (!check) continue;
    ++check.seen;
    const message = JSON.parse(new TextDecoder().decode(data));
    assert.ok(check.valid(message), `${name}: ${ajv.errorsText(check.valid.errors)}`);
    assert.deepEqual(Object.keys(message).sort(), check.fields, name);
  }
  assert.ok([...checks.values()].every(({ seen }) => seen > 0));
  assert.deepEqual([...checks.keys()].sort(), ["FrameTransform", "Log", "PointCloud", "PoseInFrame", "PosesInFrame", "SceneUpdate"]
    .map((name) => `foxglove.${name}`));
});

test("points are those of the PLY file", async () => {
  const [{ utime, message }] = await messagesOf("/points/1/5");
  assert.equal(utime, events[0].utime);
  assert.equal(message.frame_id, "map 1/5");
  const bytes = Buffer.from(message.data, "base64");
  assert.equal(bytes.length, 2 * message.point_stride);
  assert.deepEqual([0, 4, 8].map((offset) => bytes.readFloatLE(offset)), [1.5, -2.25, 3]);
  assert.deepEqual([...bytes.subarray(16 + 12)], [213, 94, 0, 255]);
});

// What is to be seen after these messages of /scene, by id.
function seenAfter(updates) {
  const alive = new Map();
  for (const { deletions, entities } of updates) {
    deletions.forEach(({ id }) => alive.delete(id));
    entities.forEach((entity) => alive.set(entity.id, entity));
  }
  return alive;
}

test("the scene has every trajectory and the constraints between them", async () => {
  const alive = seenAfter((await messagesOf("/scene")).map(({ message }) => message));
  const last = events.filter(({ channel }) => channel === "MAP_STATE").at(-1).message;
  assert.equal(last.maps.length, 2);
  const frame = `map ${last.group.agent_id}/${last.group.opened_utime}`;
  assert.equal(alive.size, 4, [...alive.keys()].join());
  assert.ok([...alive.values()].every(({ frame_id }) => frame_id === frame));
  const points = (id) => alive.get(`${frame}: ${id}`).lines[0].points;
  for (const { agent_id, opened_utime } of last.maps) {
    const positions = last.keyframes.filter(({ id }) => id.map.agent_id === agent_id).map(({ T_map_body }) => T_map_body.translation);
    assert.deepEqual(points(`trajectory ${agent_id}/${opened_utime}`), positions);
  }
  const accepted = events.filter(({ channel, message }) => channel === "CONSTRAINT" && message.accepted).length;
  assert.ok(points("accepted").length > 0.8 * 2 * accepted && points("accepted").length <= 2 * accepted, points("accepted").length);
  assert.ok(points("refused").length > 0);
});

test("a group that became part of another is not drawn any more", () => {
  const [one, two] = [1, 2].map((agent_id) => ({ agent_id, opened_utime: 5 }));
  const T_map_body = { translation: { x: 0, y: 0, z: 0 }, rotation: { x: 0, y: 0, z: 0, w: 1 } };
  const state = (revision, group, maps) => ({ utime: 7, channel: "MAP_STATE", type: "map_state_t", message: {
    group, revision, chunk: 0, num_chunks: 1, maps, keyframes: maps.map((map) => ({ id: { map, seq: 0 }, T_map_body })) } });
  const drawn = new Drawn();
  const updates = [state(1, one, [one]), state(2, two, [two]), state(3, one, [one, two])]
    .flatMap((event) => drawn.of(event)).filter(([topic]) => topic === "/scene").map(([, , message]) => message);
  assert.deepEqual([...seenAfter(updates.slice(0, 2)).keys()].filter((id) => id.includes("trajectory")),
    ["map 1/5: trajectory 1/5", "map 2/5: trajectory 2/5"]);
  assert.deepEqual([...seenAfter(updates).keys()].sort(), ["accepted", "refused", "trajectory 1/5", "trajectory 2/5"].map((id) => `map 1/5: ${id}`));
});

test("a fused map's own frame lies in its group's", async () => {
  const transforms = (await messagesOf("/tf")).filter(({ message }) => message.child_frame_id.startsWith("map"));
  assert.ok(transforms.length > 0);
  const said = events.filter(({ channel, message }) => channel === "CORRECTION_2" && message.group.agent_id === 1).at(-1).message;
  const { parent_frame_id, child_frame_id, translation } = transforms.at(-1).message;
  assert.match(parent_frame_id, /^map 1\//);
  assert.match(child_frame_id, /^map 2\//);
  assert.deepEqual(translation, said.T_map_odom.translation);
});

test("an agent's body is a frame, to be followed", async () => {
  const of = (await messagesOf("/tf")).filter(({ message }) => message.child_frame_id === "body 2");
  const poses = await messagesOf("/pose/2");
  assert.equal(of.length, poses.length);
  of.forEach(({ utime, message: { parent_frame_id, translation, rotation } }, i) => {
    assert.equal(utime, poses[i].utime);
    assert.equal(parent_frame_id, poses[i].message.frame_id);
    assert.deepEqual({ position: translation, orientation: rotation }, poses[i].message.pose);
  });
});
