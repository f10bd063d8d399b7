// The agent as the page and Node use it: odometry and uplink, compiled to WebAssembly (modules/phone/agent). Whoever calls it owns
// sensors, clock, network and storage: samples and times go in, sealed packets, poses and keyframes to store come out.
// One thread: in a page, a Web Worker.
//
// Frames as everywhere: p_a = T_a_b * p_b; `body` is the IMU, `odom` has z up. Times are microseconds.

import type { CalibrationConfig, CalibrationOutcome, CalibrationProgress } from '../calibration/camera_calibration';
import { packRows } from '../sensors/luma';

/** x, y, z in metres; qx, qy, qz, qw. */
export type Pose7 = [number, number, number, number, number, number, number];
export type Vector3 = [number, number, number];

interface AgentConfig {
  /** 1 to 65535. */
  agent: number;
  /** The agent's key, 64 hexadecimal digits; empty: no uplink, the odometry alone. */
  keyHex: string;
  /** The text of mav0/cam0/sensor.yaml (docs/recordings.md), and of mav0/imu0/sensor.yaml; without the latter options' live_imu counts. */
  cameraYaml: string;
  imuYaml?: string;
  /** What `pangea-vio --options` and `pangea-uplink --options` take. */
  vioOptionsYaml?: string;
  uplinkOptionsYaml?: string;
  /** Images come with poses of the device's own odometry (addPosedImage), in place of ours. */
  devicePoses?: boolean;
  /** Wall clock, µs since 1970: names the map, so no two runs of an agent may have the same. */
  openedUtime: number;
}

export interface AgentPose {
  /** Of the image, sensor clock. */
  utime: number;
  state: 'initialising' | 'tracking' | 'lost';
  /** Why it does not track, for people; while it does, that the scale is not known, or empty. */
  reason: string;
  /** "agent/openedUtime" of the map whose odom frame this is. */
  map: string;
  T_odom_body: Pose7;
  /** In the map frame of `group`; both since the first correction of this map. */
  T_map_body?: Pose7;
  /** The map whose odom frame is the map frame: the oldest of those that are fused. */
  group?: string;
  /** The server has fused this map into an older one. Of the oldest map of a group an agent is not told that others joined it; `others` says so. */
  fused: boolean;
  /** Features tracked in this image. */
  numTracked: number;
}

export interface ProcessStatus {
  text: string;
  /** STATUS_vio_k and STATUS_uplink_k: `counters`, with `pending` and, of each reason, `refused: REASON`. */
  counters: Record<string, number>;
}

export interface ShownAnchor {
  /** "agent/createdUtime". */
  id: string;
  name: string;
  payload: string;
  /** The agent that made it; 0: a tool on the server. */
  owner: number;
  /** Where to draw it now, in the odom frame of the newest pose's map. */
  T_odom_anchor: Pose7;
  /** Of its position, the largest of three standard deviations. */
  sigma_m: number;
  revision: number;
}

export interface OtherAgent {
  agent: number;
  /** Its camera, in the odom frame of `Others.map`. */
  T_odom_cam: Pose7;
}

/** All other agents of the group that track now, at most 16. */
export interface Others {
  map: string;
  others: OtherAgent[];
}

export interface SpoolChange {
  op: 'put' | 'delete';
  id: string;
  /** With 'put'. */
  bytes?: Uint8Array;
}

/** What has come out since the last call that returned some. */
export interface AgentEvents {
  /** Sealed packets for the gateway's WebSocket, a binary message each. */
  linkUp: Uint8Array[];
  /** The newest; absent when no image was processed. */
  pose?: AgentPose;
  /** Once a second. */
  status?: { vio?: ProcessStatus; uplink?: ProcessStatus };
  /** All that are shown; absent when nothing changed. Twenty times a second while one moves, else once a second. */
  anchors?: ShownAnchor[];
  /** Five times a second while there are any; absent in between. Who is not among them for two seconds is away. */
  others?: Others;
  /** Keyframes to keep until they are acknowledged, in this order. */
  spool: SpoolChange[];
  /** Finished keyframes, encoded keyframe_2_t, for --out-keyframes and tests. */
  keyframes: Uint8Array[];
}

export interface AnchorEdit {
  /** At most 50 bytes. */
  name: string;
  /** At most 1000 bytes. */
  payload: string;
  /** Of the image (sensor clock), which was tracked. */
  utime: number;
  /** On the surface behind this pixel of that image. */
  pixel?: [number, number];
  /** Or in the body at that time. */
  T_body_anchor?: Pose7;
}

// The classes that binding.cc exports.
interface NativeAgent {
  imageBuffer(bytes: number): Uint8Array;
  addImu(utime: number, gx: number, gy: number, gz: number, ax: number, ay: number, az: number): void;
  addImage(utime: number, width: number, height: number): void;
  addPosedImage(utime: number, width: number, height: number, T_odom_body: Pose7 | null): void;
  onLinkDown(packet: Uint8Array): void;
  restore(id: string, bytes: Uint8Array): void;
  placeAnchor(edit: AnchorEdit): string;
  removeAnchor(id: string): void;
  poll(nowUs: number): void;
  startAnew(): void;
  flush(): void;
  take(): AgentEvents;
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

/** The default export of pangea_agent.mjs (createPangeaAgent); `options` as emscripten's, e.g. locateFile. */
export type WasmModuleFactory = (options?: object) => Promise<NativeModule>;

export class PhoneAgent {
  private constructor(
    private readonly module: NativeModule,
    private readonly native: NativeAgent,
  ) {}

  /** Throws what is wrong with the configuration: the field and the mend. */
  static async load(factory: WasmModuleFactory, config: AgentConfig, options?: object): Promise<PhoneAgent> {
    const module = await factory(options);
    const { agent, error } = module.createAgent(config);
    if (!agent) {
      throw new Error(error);
    }
    return new PhoneAgent(module, agent);
  }

  /** rad/s and m/s² (specific force: +9.81 upwards when stationary), in the body frame; in the order of time. */
  addImu(utime: number, gyro: Vector3, accel: Vector3): void {
    this.native.addImu(utime, ...gyro, ...accel);
  }

  /**
   * A grey image of the calibration's size, `stride` bytes a row. It is processed when samples have come that reach past it: in this
   * call, or in an addImu after it, whose results the next call returns.
   */
  addImage(utime: number, luma: Uint8Array, width: number, height: number, stride: number): AgentEvents {
    const buffer = this.native.imageBuffer(width * height);
    packRows(luma, width, height, stride, buffer);
    this.native.addImage(utime, width, height);
    return this.native.take();
  }

  /** With `devicePoses`: with the pose that the device has for it, z up; without one it is lost. */
  addPosedImage(utime: number, luma: Uint8Array, width: number, height: number, stride: number, T_odom_body: Pose7 | null): AgentEvents {
    packRows(luma, width, height, stride, this.native.imageBuffer(width * height));
    this.native.addPosedImage(utime, width, height, T_odom_body);
    return this.native.take();
  }

  /** A packet from the gateway's WebSocket. What is not for this agent is counted and dropped. */
  onLinkDown(packet: Uint8Array): void {
    this.native.onLinkDown(packet);
  }

  /** What an earlier run has put and not deleted, in the order of putting; before the first image. */
  restoreSpool(entries: Array<{ id: string; bytes: Uint8Array }>): void {
    for (const { id, bytes } of entries) {
      this.native.restore(id, bytes);
    }
  }

  /** The new anchor's id. Throws when the agent does not track, or a field is out of its bounds. */
  placeAnchor(edit: AnchorEdit): string {
    const id = this.native.placeAnchor(edit);
    if (id.startsWith('error: ')) {
      throw new Error(id.slice('error: '.length));
    }
    return id;
  }

  removeAnchor(id: string): void {
    this.native.removeAnchor(id);
  }

  /** Every 10 to 20 ms. `nowUs`: µs since 1970 that never step, 1000 * (performance.timeOrigin + performance.now()). */
  poll(nowUs: number): AgentEvents {
    this.native.poll(nowUs);
    return this.native.take();
  }

  /** The sensors' time begins anew: finishes the map, the next image opens another. */
  startAnew(): void {
    this.native.startAnew();
  }

  /** No more images: finishes the keyframes in the window. */
  flush(): AgentEvents {
    this.native.flush();
    return this.native.take();
  }

  heapBytes(): number {
    return this.module.heapBytes();
  }

  /** Frees it; it may not be called any more. */
  close(): void {
    this.native.delete();
  }
}
