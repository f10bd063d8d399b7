// The messages between the page and the worker that runs the agent. Times are microseconds.

import type { AgentCamera, PhonePose, NewAnchor, Others, Pose7, ProcessStatus, DrawnAnchor } from "./agent/phone_agent";
import type { ImuSample } from "./recording/euroc";

// The phone's identity at the server, which it got by joining.
export interface Membership {
  agent: number;
  key: string; // 64 hexadecimal digits
  site: string;
  name: string;
}

export interface OpenAgent {
  kind: "open";
  membership?: Membership; // without it only the odometry runs
  cameraYaml: string;
  imuYaml?: string;
  vioOptionsYaml?: string;
  openedUtime: number; // of its first map (openingTime)
  devicePoses?: boolean; // images have poses of the device's odometry, which replaces ours
}

export type ToWorker =
  | OpenAgent
  | { kind: "imu"; samples: Float64Array } // kImuStride values per sample: utime, gyro xyz, accel xyz
  | { kind: "image"; utime: number; luma: Uint8Array; width: number; height: number; stride: number; T_odom_body?: Pose7 | null }
  | { kind: "place"; edit: NewAnchor }
  | { kind: "remove"; id: string }
  | { kind: "end_map" } // finishes the keyframes in the window; the next image opens a new map
  | { kind: "close" }; // ends the map; what the server does not have is stored for the next time

export const kImuStride = 7;

export function packImu(samples: ImuSample[]): Float64Array<ArrayBuffer> {
  const values = new Float64Array(kImuStride * samples.length);
  samples.forEach(({ utime, gyro, accel }, i) => values.set([utime, ...gyro, ...accel], kImuStride * i));
  return values;
}

// refused: the gateway does not know the agent's key, or it was revoked. replaced: the same agent runs in another page.
export type LinkState = "connecting" | "open" | "refused" | "replaced";

export type FromWorker =
  | { kind: "opened" }
  | { kind: "failed"; text: string } // the agent cannot be opened, or is broken
  | { kind: "taken"; utime: number } // the agent is done with the image
  | { kind: "pose"; pose: PhonePose }
  | { kind: "camera"; camera: AgentCamera }
  | { kind: "anchors"; anchors: DrawnAnchor[] }
  | { kind: "others"; told: Others }
  | { kind: "status"; vio?: ProcessStatus; uplink?: ProcessStatus; link?: LinkState }
  | { kind: "placed"; id: string }
  | { kind: "refused"; text: string } // an anchor was refused
  | { kind: "storage_failed"; text: string }
  | { kind: "closed" };
