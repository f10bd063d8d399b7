// Messages of a captured log, as `pangea-log list --json` prints them, into an MCAP file for Foxglove.
//
// Every channel becomes a topic of JSON messages of the type's name. Besides, what can be drawn:
//   /pose/<agent>   foxglove.PoseInFrame    the corrected pose, as the agent shows it
//   /map/<agent>    foxglove.PosesInFrame   its keyframes in the newest complete state of their group
//   /verdicts       foxglove.Log            every constraint, accepted or why it was refused
// A frame is a group: "map 1/1700000000000000", after the map whose odom frame it is.

import { createInterface } from "node:readline";
import { McapWriter } from "@mcap/core";

const TRACKING = 2; // pose_t.STATE_TRACKING
const INTRA = 1; // place_candidate_t.KIND_INTRA
const INFO = 2, WARNING = 3; // foxglove.Log levels

const object = (properties) => ({ type: "object", properties });
const numbers = (...names) => object(Object.fromEntries(names.map((name) => [name, { type: "number" }])));
const TIME = object({ sec: { type: "integer" }, nsec: { type: "integer" } });
const POSE = object({ position: numbers("x", "y", "z"), orientation: numbers("x", "y", "z", "w") });
const TEXT = { type: "string" };
const DRAWN = {
  "foxglove.PoseInFrame": object({ timestamp: TIME, frame_id: TEXT, pose: POSE }),
  "foxglove.PosesInFrame": object({ timestamp: TIME, frame_id: TEXT, poses: { type: "array", items: POSE } }),
  "foxglove.Log": object({
    timestamp: TIME, level: { type: "integer" }, message: TEXT, name: TEXT, file: TEXT, line: { type: "integer" },
  }),
};

/** The JSON schema of values like this one. */
function schemaOf(value) {
  if (Array.isArray(value)) {
    return value.length > 0 ? { type: "array", items: schemaOf(value[0]) } : { type: "array" };
  }
  if (value !== null && typeof value === "object") {
    return object(Object.fromEntries(Object.entries(value).map(([key, of]) => [key, schemaOf(of)])));
  }
  return value === null ? {} : { type: typeof value };
}

const timeOf = (utime) => ({ sec: Math.floor(utime / 1e6), nsec: (utime % 1e6) * 1000 });
const nameOf = (id) => `${id.agent_id}/${id.opened_utime}`;
const poseOf = ({ rotation, translation }) => ({ position: translation, orientation: rotation });

/** The chunks of one state until all have come; then its keyframes by agent. */
class States {
  #pending = new Map();

  add(chunk) {
    const key = `${nameOf(chunk.group)} ${chunk.revision}`;
    const chunks = (this.#pending.get(key) ?? new Map()).set(chunk.chunk, chunk.keyframes ?? []);
    this.#pending.set(key, chunks);
    if (chunks.size < chunk.num_chunks) {
      return new Map();
    }
    this.#pending.delete(key);
    const byAgent = new Map();
    for (const keyframe of [...chunks.values()].flat()) {
      const agent = keyframe.id.map.agent_id;
      byAgent.set(agent, [...(byAgent.get(agent) ?? []), poseOf(keyframe.T_map_body)]);
    }
    return byAgent;
  }
}

/** In whose frame a corrected pose is: the group of the correction it has applied, or its own map. */
class Frames {
  #groups = new Map();

  note(correction) {
    this.#groups.set(`${nameOf(correction.map)} ${correction.revision}`, nameOf(correction.group));
  }
  of(pose) {
    return this.#groups.get(`${nameOf(pose.map)} ${pose.group_revision}`) ?? nameOf(pose.map);
  }
}

/** What can be drawn of a message: topic, schema, message. */
function drawn({ utime, channel, type, message }, states, frames) {
  const timestamp = timeOf(utime);
  if (type === "correction_t") {
    frames.note(message);
  }
  if (type === "pose_t" && message.state === TRACKING) {
    const frame_id = `map ${frames.of(message)}`;
    return [[`/pose/${channel.slice("POSE_".length)}`, "foxglove.PoseInFrame",
      { timestamp, frame_id, pose: poseOf(message.T_map_body) }]];
  }
  if (type === "map_state_t" && channel === "MAP_STATE") {
    const frame_id = `map ${nameOf(message.group)}`;
    return [...states.add(message)].map(([agent, poses]) =>
      [`/map/${agent}`, "foxglove.PosesInFrame", { timestamp, frame_id, poses }]);
  }
  if (type === "constraint_t") {
    const ends = [message.to, message.from].map((id) => `${nameOf(id.map)}#${id.seq}`).join(" in ");
    return [["/verdicts", "foxglove.Log", {
      timestamp, level: message.accepted ? INFO : WARNING, name: message.kind === INTRA ? "inter_map_ba" : "fusion",
      message: `${message.id}: ${ends}: ${message.accepted ? "accepted" : message.reason}`, file: "", line: 0,
    }]];
  }
  return [];
}

/** Writes what the lines say to `writable`; returns how many messages of the log there were. */
export async function convert(lines, writable) {
  const writer = new McapWriter({ writable });
  await writer.start({ profile: "", library: "pangea" });
  const schemas = new Map(), channels = new Map();
  const write = async (topic, schema, utime, message) => {
    if (!channels.has(topic)) {
      if (!schemas.has(schema)) {
        const data = new TextEncoder().encode(JSON.stringify(DRAWN[schema] ?? schemaOf(message)));
        schemas.set(schema, await writer.registerSchema({ name: schema, encoding: "jsonschema", data }));
      }
      channels.set(topic, { sequence: 0, id: await writer.registerChannel({
        topic, schemaId: schemas.get(schema), messageEncoding: "json", metadata: new Map() }) });
    }
    const channel = channels.get(topic);
    const time = BigInt(utime) * 1000n;
    await writer.addMessage({ channelId: channel.id, sequence: channel.sequence++, logTime: time, publishTime: time,
      data: new TextEncoder().encode(JSON.stringify(message)) });
  };

  const states = new States(), frames = new Frames();
  let count = 0;
  for await (const line of lines) {
    const event = JSON.parse(line);
    if (event.type === null) {
      continue;
    }
    ++count;
    await write(event.channel, `pangea.${event.type}`, event.utime, event.message);
    for (const [topic, schema, message] of drawn(event, states, frames)) {
      await write(topic, schema, event.utime, message);
    }
  }
  await writer.end();
  return count;
}

export const linesOf = (stream) => createInterface({ input: stream, crlfDelay: Infinity });
