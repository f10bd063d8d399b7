// Messages of a captured log, as `pangea-log list --json` prints them, into an MCAP file for Foxglove: every channel becomes
// a topic of JSON messages of the type's name, and beside them stands what can be drawn (drawn.js).

import { createInterface } from "node:readline";
import * as foxglove from "@foxglove/schemas/jsonschema.js";
import { McapWriter } from "@mcap/core";
import { cloudOf, Drawn } from "./drawn.js";

/** The JSON schema of values like this one. */
function schemaOf(value) {
  if (Array.isArray(value)) {
    return value.length > 0 ? { type: "array", items: schemaOf(value[0]) } : { type: "array" };
  }
  if (value !== null && typeof value === "object") {
    const properties = Object.fromEntries(Object.entries(value).map(([key, of]) => [key, schemaOf(of)]));
    return { type: "object", properties };
  }
  return value === null ? {} : { type: typeof value };
}

/** Foxglove's own schema of one of its types, e.g. "foxglove.Log". */
export const wellKnown = (name) => foxglove[name.slice("foxglove.".length)];

class Topics {
  #writer;
  #schemas = new Map();
  #channels = new Map();

  constructor(writer) {
    this.#writer = writer;
  }

  async #schema(name, message) {
    if (!this.#schemas.has(name)) {
      const schema = name.startsWith("foxglove.") ? wellKnown(name) : schemaOf(message);
      const data = new TextEncoder().encode(JSON.stringify(schema));
      this.#schemas.set(name, await this.#writer.registerSchema({ name, encoding: "jsonschema", data }));
    }
    return this.#schemas.get(name);
  }

  async write(topic, schema, utime, message) {
    if (!this.#channels.has(topic)) {
      const schemaId = await this.#schema(schema, message);
      const id = await this.#writer.registerChannel({ topic, schemaId, messageEncoding: "json", metadata: new Map() });
      this.#channels.set(topic, { sequence: 0, id });
    }
    const channel = this.#channels.get(topic);
    const time = BigInt(utime) * 1000n;
    await this.#writer.addMessage({ channelId: channel.id, sequence: channel.sequence++, logTime: time, publishTime: time,
      data: new TextEncoder().encode(JSON.stringify(message)) });
  }
}

/** Writes what the lines say, and the clouds of PLY texts, to `writable`; returns how many messages of the log there were. */
export async function convert(lines, writable, plys = []) {
  const writer = new McapWriter({ writable });
  await writer.start({ profile: "", library: "pangea" });
  const topics = new Topics(writer), drawn = new Drawn();
  let count = 0;
  for await (const line of lines) {
    const event = JSON.parse(line);
    if (event.type === null) {
      continue;
    }
    if (count++ === 0) {
      for (const [topic, schema, cloud] of plys.map((ply) => cloudOf(ply, event.utime))) {
        await topics.write(topic, schema, event.utime, cloud);
      }
    }
    await topics.write(event.channel, `pangea.${event.type}`, event.utime, event.message);
    for (const [topic, schema, message] of drawn.of(event)) {
      await topics.write(topic, schema, event.utime, message);
    }
  }
  await writer.end();
  return count;
}

/** The stream's lines. A generator: readline reads from the moment it is made, and drops what nobody asked for yet. */
export async function* linesOf(stream) {
  yield* createInterface({ input: stream, crlfDelay: Infinity });
}
