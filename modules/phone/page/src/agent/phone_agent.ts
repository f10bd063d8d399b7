// The agent as the page and Node use it: odometry and uplink, compiled to WebAssembly (modules/phone/agent). The caller owns sensors,
// clock, network and storage. Samples and times go in; sealed packets, poses and keyframes to store come out. It must be used on one
// thread; in a page this is a Web Worker.
//
// Frames: p_a = T_a_b * p_b; `body` is the IMU, `odom` has z up. Times are microseconds.

import type { CalibrationConfig, CalibrationOutcome, CalibrationProgress } from "../calibration/camera_calibration";
import { packRows } from "../sensors/luma";

/** x, y, z in metres, then the quaternion qx, qy, qz, qw. */
export type Pose7 = [number, number, number, number, number, number, number];
export type Vector3 = [number, number, number];

interface AgentConfig {
  /** 1 to 65535. */
  agent: number;
  /** The agent's key, 64 hexadecimal digits; empty: only the odometry runs, without uplink. */
  keyHex: string;
  /** The texts of mav0/cam0/sensor.yaml and mav0/imu0/sensor.yaml (docs/recordings.md). Without the latter, live_imu of the options is used. */
  cameraYaml: string;
  imuYaml?: string;
  /** The texts of options files, as for `pangea-vio --options` and `pangea-uplink --options`. */
  vioOptionsYaml?: string;
  uplinkOptionsYaml?: string;
  /** The device's odometry replaces ours: each image comes with its pose (addPosedImage). */
  devicePoses?: boolean;
  /** Wall clock, µs since 1970. It becomes the map's id, so no two runs of an agent may have the same. */
  openedUtime: number;
}

export interface PhonePose {
  /** Time of the image, sensor clock. */
  utime: number;
  state: "initialising" | "tracking" | "lost";
  /** For people: why the odometry does not track. While it tracks: that the scale is not known, or empty. */
  reason: string;
  /** "agent/openedUtime" of the map whose odom frame this is. */
  map: string;
  T_odom_body: Pose7;
  /** The pose in the map frame of `group`. Both are set after the first correction of this map. */
  T_map_body?: Pose7;
  /** The oldest of the fused maps; its odom frame is the map frame. */
  group?: string;
  /** The server has fused this map into an older one. It stays false for the oldest map of a group; `others` tells who joined that. */
  fused: boolean;
  /** Number of features tracked in this image. */
  numTracked: number;
}

/** The camera of `core/camera_model.h`. */
export interface AgentCamera {
  model: "radial-tangential" | "equidistant";
  width: number;
  height: number;
  intrinsics: [number, number, number, number];
  distortion: [number, number, number, number];
  T_body_cam: Pose7;
  readout_s: number;
}

export interface ProcessStatus {
  text: string;
  /** From STATUS_vio_k or STATUS_uplink_k: its `counters`, `pending`, and for each reason `refused: REASON`. */
  counters: Record<string, number>;
}

export interface DrawnAnchor {
  /** "agent/createdUtime". */
  id: string;
  name: string;
  payload: string;
  /** The agent that made the anchor; 0: a tool on the server. */
  owner: number;
  /** The pose at which to draw it now, in the odom frame of the newest pose's map. */
  T_odom_anchor: Pose7;
  /** Standard deviation of the position along its least certain direction. */
  sigma_m: number;
  revision: number;
}

export interface OtherAgent {
  agent: number;
  /** The pose of its camera in the odom frame of `Others.map`. */
  T_odom_cam: Pose7;
}

/** The other agents of the group that track now, at most 16. */
export interface Others {
  map: string;
  others: OtherAgent[];
}

export interface SpoolChange {
  op: "put" | "delete";
  id: string;
  /** Only with "put". */
  bytes?: Uint8Array;
}

/** The agent's output since the last call that returned events. */
export interface PhoneEvents {
  /** Sealed packets for the gateway's WebSocket; each is one binary message. */
  linkUp: Uint8Array[];
  /** The newest pose; absent if no image was processed. */
  pose?: PhonePose;
  /** The camera as the odometry has refined it. Comes with each new keyframe. */
  camera?: AgentCamera;
  /** Comes once per second. */
  status?: { vio?: ProcessStatus; uplink?: ProcessStatus };
  /** All anchors that are shown; absent if nothing changed. Comes 20 times per second while one moves, else once per second. */
  anchors?: DrawnAnchor[];
  /** Comes five times per second while there are any; absent in between. An agent that is not in it for two seconds is away. */
  others?: Others;
  /** Changes of the stored keyframes and edits of anchors, to be applied in this order. */
  spool: SpoolChange[];
  /** Newly finished keyframes (encoded keyframe_t, keyframe_2_t or keyframe_3_t), for --out-keyframes and tests. */
  keyframes: Uint8Array[];
}

export interface NewAnchor {
  /** At most 50 bytes. */
  name: string;
  /** At most 1000 bytes. */
  payload: string;
  /** Time of the image, sensor clock. The odometry must have tracked this image. */
  utime: number;
  /** Places the anchor on the surface behind this pixel of that image. */
  pixel?: [number, number];
  /** Or places it relative to the body at that time. */
  T_body_anchor?: Pose7;
}

// The classes that binding.cc exports, as TypeScript sees them.
interface NativeAgent {
  imageBuffer(bytes: number): Uint8Array;
  addImu(utime: number, gx: number, gy: number, gz: number, ax: number, ay: number, az: number): void;
  addImage(utime: number, width: number, height: number): void;
  addPosedImage(utime: number, width: number, height: number, T_odom_body: Pose7 | null): void;
  onLinkDown(packet: Uint8Array): void;
  restore(id: string, bytes: Uint8Array): void;
  placeAnchor(edit: NewAnchor): string;
  removeAnchor(id: string): void;
  poll(nowUs: number): void;
  startAnew(): void;
  flush(): void;
  take(): PhoneEvents;
  delete(): void;
}

export interface NativeCalibration {
  imageBuffer(): Uint8Array;
  addImu(utime: number, gx: number, gy: number, gz: number, ax: number, ay: number, az: number): void;
  addImage(utime: number): void;
  progress(): CalibrationProgress;
  solve(): CalibrationOutcome;
}

interface NativeModule {
  createAgent(config: AgentConfig): { agent?: NativeAgent; error?: string };
  createCalibration(config: CalibrationConfig): { calibration?: NativeCalibration; error?: string };
  heapBytes(): number;
}

/** The default export of pangea_agent.mjs (createPangeaAgent). `options` are emscripten's, e.g. locateFile. */
export type WasmModuleFactory = (options?: object) => Promise<NativeModule>;

export class PhoneAgent {
  private constructor(
    private readonly module: NativeModule,
    private readonly native: NativeAgent,
  ) {}

  /** Throws an error if the configuration is wrong; it names the field and says what to do. */
  static async load(factory: WasmModuleFactory, config: AgentConfig, options?: object): Promise<PhoneAgent> {
    const module = await factory(options);
    const { agent, error } = module.createAgent(config);
    if (!agent) {
      throw new Error(error);
    }
    return new PhoneAgent(module, agent);
  }

  /** Gyro in rad/s and specific force in m/s² (+9.81 upwards when stationary), in the body frame; in order of time. */
  addImu(utime: number, gyro: Vector3, accel: Vector3): void {
    this.native.addImu(utime, ...gyro, ...accel);
  }

  /**
   * Adds a grey image of the calibration's size, with `stride` bytes per row. It is processed when there are samples beyond its time: in
   * this call, or in a later addImu; the next call that returns events then has the results.
   */
  addImage(utime: number, luma: Uint8Array, width: number, height: number, stride: number): PhoneEvents {
    const buffer = this.native.imageBuffer(width * height);
    packRows(luma, width, height, stride, buffer);
    this.native.addImage(utime, width, height);
    return this.native.take();
  }

  /** With `devicePoses`: adds an image with the device's pose, z up; null if the device's odometry is lost. */
  addPosedImage(utime: number, luma: Uint8Array, width: number, height: number, stride: number, T_odom_body: Pose7 | null): PhoneEvents {
    packRows(luma, width, height, stride, this.native.imageBuffer(width * height));
    this.native.addPosedImage(utime, width, height, T_odom_body);
    return this.native.take();
  }

  /** Takes a packet from the gateway's WebSocket. Packets that are not for this agent are counted and dropped. */
  onLinkDown(packet: Uint8Array): void {
    this.native.onLinkDown(packet);
  }

  /** Gives back what an earlier run put and did not delete, in the order of putting. Call it before the first image. */
  restoreSpool(entries: Array<{ id: string; bytes: Uint8Array }>): void {
    for (const { id, bytes } of entries) {
      this.native.restore(id, bytes);
    }
  }

  /** Returns the new anchor's id. Throws if the agent has no key or did not track that image, or a field is out of bounds. */
  placeAnchor(edit: NewAnchor): string {
    const id = this.native.placeAnchor(edit);
    if (id.startsWith("error: ")) {
      throw new Error(id.slice("error: ".length));
    }
    return id;
  }

  removeAnchor(id: string): void {
    this.native.removeAnchor(id);
  }

  /** Call it every 10 to 20 ms. `nowUs`: µs since 1970 without steps, 1000 * (performance.timeOrigin + performance.now()). */
  poll(nowUs: number): PhoneEvents {
    this.native.poll(nowUs);
    return this.native.take();
  }

  /** The sensors' time starts again: finishes the map; the next image opens another. */
  startAnew(): void {
    this.native.startAnew();
  }

  /** No more images come: finishes the keyframes in the window. */
  flush(): PhoneEvents {
    this.native.flush();
    return this.native.take();
  }

  heapBytes(): number {
    return this.module.heapBytes();
  }

  /** Frees the agent; it must not be called any more. */
  close(): void {
    this.native.delete();
  }
}
