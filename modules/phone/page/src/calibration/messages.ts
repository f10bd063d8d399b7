// The messages between the page and the worker that calibrates. Times are microseconds.

import type { CalibrationConfig, CalibrationProgress } from "./camera_calibration";

export type ToCalibration =
  | { kind: "open"; config: CalibrationConfig }
  | { kind: "imu"; samples: Float64Array } // kImuStride values per sample, as for the agent
  | { kind: "image"; utime: number; luma: Uint8Array; stride: number }
  | { kind: "finish" }; // no more data come: solve with those that there are

export type FromCalibration =
  | { kind: "failed"; text: string }
  | { kind: "taken"; utime: number }
  | { kind: "progress"; progress: CalibrationProgress } // share 1: it now solves, which takes seconds
  | { kind: "refused"; text: string } // the calibration continues, unless it was told to finish
  | { kind: "done"; cameraYaml: string };
