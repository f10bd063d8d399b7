// pangea-agent: runs the agent of phones in Node, with a recording instead of sensors.
//
//   recording ─► PhoneAgent ─► FILE.tum, FILE.lcm
//                    ▲▼ sealed packets
//                 gateway

import { readdirSync, readFileSync, statSync, writeFileSync } from "node:fs";
import { webcrypto } from "node:crypto";
import WebSocket from "ws";

import { PhoneAgent } from "../agent/phone_agent";
import type { PhoneEvents, WasmModuleFactory } from "../agent/phone_agent";
import { GatewayLink } from "../link/gateway_link";
import { isCalibrated, openRecording, withCamera } from "../recording/euroc";
import type { CalibratedRecording, Recording } from "../recording/euroc";
import type { Files } from "../recording/files";
import { argumentsOf, kHelp } from "./arguments";
import type { Arguments } from "./arguments";
import { cameraYamlOf } from "./calibrate";
import { KeyframeLog, TumFiles } from "./outputs";
import { lumaOf } from "./png";

const kPoll_ms = 10;
const kMaxLag_ms = 1000; // in real time, an image that is later than this is left out
const kImuBeforeStart_us = 500_000;
const kAhead_us = 60_000; // samples are added this far ahead: past an image's last row
const kNoPose = 2; // exit code
const kNoProgress_ms = 20_000; // at the end, longest wait without a new acknowledgement

const now_us = () => Math.round(1000 * (performance.timeOrigin + performance.now()));
const pause = (ms: number) => new Promise((done) => setTimeout(done, ms));

function filesOfFolder(folder: string): Files {
  const names = readdirSync(folder, { recursive: true }) as string[];
  return { names, read: async (name) => readFileSync(`${folder}/${name}`) };
}

async function wasm(): Promise<[WasmModuleFactory, object]> {
  const module: { default: WasmModuleFactory } = await import(new URL("./pangea_agent.mjs", import.meta.url).href);
  return [module.default, {
    wasmBinary: readFileSync(new URL("./pangea_agent.wasm", import.meta.url)),
    getRandomValue: () => webcrypto.getRandomValues(new Uint32Array(1))[0],
  }];
}

async function openCalibrated(config: Arguments): Promise<CalibratedRecording> {
  const recording = await openRecording(filesOfFolder(config.recording));
  if (isCalibrated(recording)) return recording;
  const cameraYaml = await cameraYamlOf(recording, ...(await wasm()));
  if (config.outCamera) writeFileSync(config.outCamera, cameraYaml);
  return withCamera(recording, cameraYaml, "the calibration");
}

async function loadAgent(config: Arguments, recording: CalibratedRecording): Promise<PhoneAgent> {
  const [factory, options] = await wasm();
  return PhoneAgent.load(
    factory,
    {
      agent: config.agent,
      keyHex: config.keyHex,
      cameraYaml: recording.cameraYaml,
      imuYaml: recording.imuYaml,
      vioOptionsYaml: config.optionsYaml,
      openedUtime: now_us(),
    },
    options,
  );
}

class Session {
  private readonly tum?: TumFiles;
  private readonly keyframeLog?: KeyframeLog;
  private readonly link?: GatewayLink;
  private waiting = 0; // number of keyframes that the server has not acknowledged
  private readonly times_ms: number[] = []; // CPU time of each image
  private keyframes = 0;
  private tracked = 0;
  private dropped = 0;
  private reason = "no image came to the odometry";

  constructor(
    private readonly agent: PhoneAgent,
    private readonly config: Arguments,
  ) {
    this.tum = config.outTum ? new TumFiles(config.outTum) : undefined;
    this.keyframeLog = config.outKeyframes ? new KeyframeLog(config.outKeyframes, config.agent) : undefined;
    if (config.gateway) {
      this.link = new GatewayLink(config.gateway, config.agent, config.keyHex, (packet) => agent.onLinkDown(packet));
    }
  }

  private take(events: PhoneEvents) {
    for (const packet of events.linkUp) this.link?.send(packet);
    for (const keyframe of events.keyframes) this.keyframeLog?.write(keyframe);
    this.keyframes += events.keyframes.length;
    for (const { op } of events.spool) this.waiting += op === "put" ? 1 : -1;
    if (events.pose?.state === "tracking") {
      ++this.tracked;
      this.tum?.write(events.pose);
    } else if (events.pose) {
      this.reason = events.pose.reason;
    }
  }

  private poll() {
    this.take(this.agent.poll(now_us()));
  }

  // Polls until `time_ms` of performance.now().
  private async waitUntil(time_ms: number) {
    do {
      this.poll();
      await pause(Math.min(kPoll_ms, Math.max(0, time_ms - performance.now())));
    } while (performance.now() < time_ms);
  }

  async play({ files, images, imu }: Recording) {
    const first = images[0].utime + 1e6 * this.config.start_s;
    const last = first + 1e6 * this.config.duration_s;
    const played = images.filter(({ utime }) => utime >= first && utime <= last);
    if (played.length === 0) throw new Error(`no image from ${this.config.start_s} s on`);
    const { rate } = this.config;
    const began_ms = performance.now();
    const from = imu.findIndex(({ utime }) => utime >= played[0].utime - kImuBeforeStart_us);
    let next = from < 0 ? imu.length : from;
    for (const { utime, name } of played) {
      const due_ms = began_ms + (utime - played[0].utime) / 1000 / rate;
      if (rate > 0 && rate <= 1 && rate * (performance.now() - due_ms) > kMaxLag_ms) {
        ++this.dropped;
        continue;
      }
      const picture = lumaOf(await files.read(name));
      if (rate > 0) await this.waitUntil(due_ms);
      for (; next < imu.length && imu[next].utime <= utime + kAhead_us; ++next) {
        this.agent.addImu(imu[next].utime, imu[next].gyro, imu[next].accel);
      }
      const begin = process.cpuUsage();
      const events = this.agent.addImage(utime, picture.luma, picture.width, picture.height, picture.width);
      const { user, system } = process.cpuUsage(begin);
      this.times_ms.push((user + system) / 1000);
      this.take(events);
      this.poll();
    }
  }

  // Finishes the keyframes in the window. With a server, waits until all keyframes are acknowledged, or none was for kNoProgress_ms.
  async finish(): Promise<number> {
    this.take(this.agent.flush());
    let progress_ms = performance.now();
    for (let waiting = Infinity; this.link && this.waiting > 0 && performance.now() - progress_ms < kNoProgress_ms; ) {
      if (this.waiting < waiting) progress_ms = performance.now();
      waiting = this.waiting;
      await this.waitUntil(performance.now() + kPoll_ms);
    }
    this.tum?.close();
    this.keyframeLog?.close();
    const sorted = [...this.times_ms].sort((a, b) => a - b);
    const share = (q: number) => (sorted[Math.floor(q * (sorted.length - 1))] ?? 0).toFixed(2);
    const mean_ms = sorted.reduce((sum, time_ms) => sum + time_ms, 0) / Math.max(1, sorted.length);
    console.error(
      `pangea-agent: ${this.times_ms.length} images, ${this.dropped} dropped, ${this.tracked} tracked, ` +
        `${this.keyframes} keyframes, ${this.waiting} not acknowledged; ms of CPU an image: ` +
        `median ${share(0.5)}, 95 % ${share(0.95)}, mean ${mean_ms.toFixed(2)}; heap ${(this.agent.heapBytes() / 1e6).toFixed(1)} MB`,
    );
    if (this.tracked === 0) console.error(`pangea-agent: no pose: ${this.reason}`);
    return this.tracked > 0 ? 0 : kNoPose;
  }
}

async function main(): Promise<number> {
  const config = argumentsOf(process.argv.slice(2));
  if (!config) {
    console.log(kHelp);
    return 0;
  }
  statSync(config.recording);
  const recording = await openCalibrated(config);
  const session = new Session(await loadAgent(config, recording), config);
  await session.play(recording);
  return session.finish();
}

globalThis.WebSocket ??= WebSocket as unknown as typeof globalThis.WebSocket; // Node has one from 22 on
main().then(
  (code) => process.exit(code),
  (error: Error) => {
    console.error(`pangea-agent: ${error.message}`);
    process.exit(1);
  },
);
