// What the page and the worker that holds the agent say to each other. Times are microseconds.

import type { AgentPose, AnchorEdit, Others, Pose7, ProcessStatus, ShownAnchor } from "./agent/phone_agent";
import type { ImuSample } from "./recording/euroc";

// Who this phone is at the server; from joining.
export interface Membership {
  agent: number;
  key: string; // 64 hexadecimal digits
  site: string;
  name: string;
}

export interface OpenAgent {
  kind: "open";
  membership?: Membership; // without it the odometry runs alone
  cameraYaml: string;
  imuYaml?: string;
  vioOptionsYaml?: string;
  devicePoses?: boolean; // images have poses, in place of our odometry
}

export type ToWorker =
  | OpenAgent
  | { kind: "imu"; samples: Float64Array } // kImuStride values each: utime, gyro xyz, accel xyz
  | { kind: "image"; utime: number; luma: Uint8Array; width: number; height: number; stride: number; T_odom_body?: Pose7 | null }
  | { kind: "place"; edit: AnchorEdit }
  | { kind: "remove"; id: string }
  | { kind: "end_map" } // the keyframes of the window are finished; what comes next is a new map
  | { kind: "close" }; // ends the map; what the server does not have is stored for the next time

export const kImuStride = 7;

export function packImu(samples: ImuSample[]): Float64Array<ArrayBuffer> {
  const values = new Float64Array(kImuStride * samples.length);
  samples.forEach(({ utime, gyro, accel }, i) => values.set([utime, ...gyro, ...accel], kImuStride * i));
  return values;
}

// refused: the gateway does not, or no longer, know the agent's key. replaced: the same agent runs in another page.
export type LinkState = "connecting" | "open" | "refused" | "replaced";

export type FromWorker =
  | { kind: "opened" }
  | { kind: "failed"; text: string } // the agent cannot be opened, or is broken
  | { kind: "taken"; utime: number } // the agent is done with the image
  | { kind: "pose"; pose: AgentPose }
  | { kind: "anchors"; anchors: ShownAnchor[] }
  | { kind: "others"; told: Others }
  | { kind: "status"; vio?: ProcessStatus; uplink?: ProcessStatus; link?: LinkState }
  | { kind: "placed"; id: string }
  | { kind: "refused"; text: string } // an anchor
  | { kind: "storage_failed"; text: string }
  | { kind: "closed" };
