// What the page and the worker that calibrates say to each other. Times are microseconds.

import type { CalibrationConfig, CalibrationProgress } from "./camera_calibration";

export type ToCalibration =
  | { kind: "open"; config: CalibrationConfig }
  | { kind: "imu"; samples: Float64Array } // kImuStride values each, as to the agent
  | { kind: "image"; utime: number; luma: Uint8Array; stride: number }
  | { kind: "finish" }; // no more comes: what there is must do

export type FromCalibration =
  | { kind: "failed"; text: string }
  | { kind: "taken"; utime: number }
  | { kind: "progress"; progress: CalibrationProgress } // 1: it solves now, for seconds
  | { kind: "refused"; text: string } // it goes on, unless it was to finish
  | { kind: "done"; cameraYaml: string };
