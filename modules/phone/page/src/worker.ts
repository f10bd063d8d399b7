// Runs one agent at a time in a Web Worker: odometry, uplink, the WebSocket to the gateway, and the store of what waits for the server.

import { PhoneAgent } from "./agent/phone_agent";
import type { PhoneEvents, NewAnchor, WasmModuleFactory } from "./agent/phone_agent";
import { SpoolStore, spoolOf } from "./agent/spool_store";
import { GatewayLink, gatewayOrigin } from "./link/gateway_link";
import { kImuStride } from "./messages";
import type { FromWorker, OpenAgent, ToWorker } from "./messages";

const kPoll_ms = 10;
const kModule = "/pangea_agent.mjs"; // beside the page
const kAlone = 1; // id of an agent without membership, which nobody else sees

const say = (message: FromWorker) => postMessage(message);
const fail = (error: Error) => say({ kind: "failed", text: String(error.message ?? error) });
const storageFailed = (error: unknown) => void say({ kind: "storage_failed", text: String(error) });
// Loads the agent's program once, for all agents of this worker.
let program: ReturnType<WasmModuleFactory> | undefined;
const load: WasmModuleFactory = () => (program ??= import(/* @vite-ignore */ kModule).then((module: { default: WasmModuleFactory }) => module.default()));

const now_us = () => Math.round(1000 * (performance.timeOrigin + performance.now()));

class AgentHost {
  private link?: GatewayLink;
  private spool?: SpoolStore; // absent without membership, and where the browser has no storage, as in some private windows
  private stored = Promise.resolve(); // resolves when all changes so far are in the spool
  private polling?: ReturnType<typeof setInterval>;

  private constructor(
    private readonly agent: PhoneAgent,
    private readonly devicePoses: boolean,
  ) {}

  static async open({ membership, cameraYaml, imuYaml, vioOptionsYaml, openedUtime, devicePoses }: OpenAgent): Promise<AgentHost> {
    const agent = await PhoneAgent.load(load, {
      agent: membership?.agent ?? kAlone,
      keyHex: membership?.key ?? "",
      cameraYaml,
      imuYaml,
      vioOptionsYaml,
      devicePoses,
      openedUtime,
    });
    const host = new AgentHost(agent, devicePoses ?? false);
    if (membership) await host.connect(membership.agent, membership.key);
    host.polling = setInterval(() => host.poll(), kPoll_ms);
    return host;
  }

  private async connect(agent: number, key: string) {
    try {
      this.spool = await SpoolStore.open(spoolOf(agent));
      this.agent.restoreSpool(await this.spool.entries());
    } catch (error) {
      storageFailed(error);
    }
    this.link = new GatewayLink(gatewayOrigin(), agent, key, (packet) => this.agent.onLinkDown(packet));
  }

  on(message: Exclude<ToWorker, OpenAgent>) {
    switch (message.kind) {
      case "imu":
        return this.addImu(message.samples);
      case "image":
        return this.addImage(message);
      case "place":
        return this.place(message.edit);
      case "remove":
        return this.agent.removeAnchor(message.id);
      case "end_map":
        this.take(this.agent.flush());
        return this.agent.startAnew();
      case "close":
        return void this.close().catch(fail);
    }
  }

  private async close() {
    clearInterval(this.polling);
    try {
      this.take(this.agent.flush());
      this.take(this.agent.poll(now_us()));
    } finally {
      await this.stored;
    }
    this.link?.close();
    this.spool?.close();
    this.agent.close();
    say({ kind: "closed" });
  }

  private poll() {
    try {
      this.take(this.agent.poll(now_us()));
    } catch (error) {
      fail(error as Error);
    }
  }

  private addImu(samples: Float64Array) {
    for (let i = 0; i < samples.length; i += kImuStride) {
      const [utime, gx, gy, gz, ax, ay, az] = samples.subarray(i, i + kImuStride);
      this.agent.addImu(utime, [gx, gy, gz], [ax, ay, az]);
    }
  }

  private addImage({ utime, luma, width, height, stride, T_odom_body }: Extract<ToWorker, { kind: "image" }>) {
    this.take(this.devicePoses
      ? this.agent.addPosedImage(utime, luma, width, height, stride, T_odom_body ?? null)
      : this.agent.addImage(utime, luma, width, height, stride));
    say({ kind: "taken", utime });
  }

  private place(edit: NewAnchor) {
    try {
      say({ kind: "placed", id: this.agent.placeAnchor(edit) });
    } catch (error) {
      say({ kind: "refused", text: (error as Error).message });
    }
  }

  private take(events: PhoneEvents) {
    for (const packet of events.linkUp) this.link?.send(packet);
    if (this.spool && events.spool.length > 0) {
      this.stored = this.spool.apply(events.spool).catch(storageFailed);
    }
    if (events.camera) say({ kind: "camera", camera: events.camera });
    if (events.pose) say({ kind: "pose", pose: events.pose });
    if (events.anchors) say({ kind: "anchors", anchors: events.anchors });
    if (events.others) say({ kind: "others", told: events.others });
    if (events.status) say({ kind: "status", ...events.status, link: this.link?.state });
  }
}

let host: Promise<AgentHost> | undefined;

onmessage = ({ data }: MessageEvent<ToWorker>) => {
  if (data.kind === "open") {
    host = AgentHost.open(data);
    host.then(() => say({ kind: "opened" }), fail);
  } else {
    // Messages that come while the agent is being opened wait, in order.
    host?.then((opened) => opened.on(data)).catch(fail);
  }
};
