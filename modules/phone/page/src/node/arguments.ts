// The command line of pangea-agent: those options of pangea-vio that an agent in Node has, and the gateway.

import { readFileSync } from "node:fs";
import { parseArgs } from "node:util";

export interface Arguments {
  recording: string;
  agent: number;
  start_s: number;
  duration_s: number;
  rate: number; // 0: as fast as possible
  outTum?: string;
  outKeyframes?: string;
  outCamera?: string;
  optionsYaml: string;
  gateway?: string; // "wss://host:port"
  keyHex: string; // empty without a gateway
}

export const kHelp = `Usage: pangea-agent.mjs --recording DIR --agent ID [OPTIONS]
Plays a recording in EuRoC's format into the agent as phones run it.
  --recording DIR       the folder that holds mav0
  --agent ID            1 to 65535
  --start S             seconds of the recording to skip
  --duration S          seconds of the recording to play
  --rate RATE           1, 2, ... times real time, or max (default 1)
  --options FILE        the odometry's options, as of pangea-vio
  --out-tum FILE        write the raw odometry, TUM; a second map goes to FILE.2
  --out-keyframes FILE  write the keyframes as an LCM log
  --out-camera FILE     write the camera's sensor.yaml, when the recording has none: it is calibrated first
  --gateway URL         wss://HOST:PORT of pangea-gateway; needs --key
  --key FILE            the agent's key file (pangea-agent-handler keygen)
Exit code: 0; 1 when something could not be done; 2 when the recording gave no pose.`;

function numberOf(name: string, text: string | undefined, otherwise: number, least: number): number {
  const value = text === undefined ? otherwise : Number(text);
  if (!(value >= least)) throw new Error(`--${name} ${text}: a number from ${least} on`);
  return value;
}

function keyOf(file: string): string {
  const key = /^key: *([0-9a-fA-F]{64})\s*$/m.exec(readFileSync(file, "utf8"))?.[1];
  if (!key) throw new Error(`key file ${file}: it needs a line key: with 64 hexadecimal digits`);
  return key;
}

// Returns undefined if help was asked for.
export function argumentsOf(words: string[]): Arguments | undefined {
  const text = { type: "string" } as const;
  const { values } = parseArgs({
    args: words,
    options: {
      help: { type: "boolean", short: "h" }, recording: text, agent: text, start: text, duration: text, rate: text,
      options: text, "out-tum": text, "out-keyframes": text, "out-camera": text, gateway: text, key: text,
    },
  });
  if (values.help) return undefined;
  if (!values.recording) throw new Error("--recording DIR is missing");
  if (!values.agent) throw new Error("--agent ID is missing: 1 to 65535, unique in the session");
  if (!values.gateway !== !values.key) throw new Error("--gateway and --key are given together");
  return {
    recording: values.recording,
    agent: numberOf("agent", values.agent, 0, 1),
    start_s: numberOf("start", values.start, 0, 0),
    duration_s: numberOf("duration", values.duration, Infinity, 0),
    rate: values.rate === "max" ? 0 : numberOf("rate", values.rate, 1, 0.01),
    outTum: values["out-tum"],
    outKeyframes: values["out-keyframes"],
    outCamera: values["out-camera"],
    optionsYaml: values.options ? readFileSync(values.options, "utf8") : "",
    gateway: values.gateway,
    keyHex: values.key ? keyOf(values.key) : "",
  };
}
