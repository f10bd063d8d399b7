// Calibrates a camera while somebody moves it; compiled to WebAssembly (modules/phone/agent/camera_calibration.h). It must be used on
// one thread; in a page this is a Web Worker. Times are microseconds.

import type { NativeCalibration, Vector3, WasmModuleFactory } from "../agent/phone_agent";
import { packRows } from "../sensors/luma";

export interface CalibrationConfig {
  /** Size of the images, pixels. */
  width: number;
  height: number;
  /** The text of mav0/imu0/sensor.yaml. */
  imuYaml: string;
  /** The rotation from camera to body as x, y, z, w, if it is known within some degrees. */
  q_body_cam?: [number, number, number, number];
}

export interface CalibrationProgress {
  /** Share of the motion that suffices, 0 to 1. */
  share: number;
  /** What is missing most; empty if the motion suffices. */
  missing: "" | "points" | "time" | "rotation about x" | "rotation about y" | "rotation about z";
}

/** The text of mav0/cam0/sensor.yaml with its standard deviations, or why there is none. */
export type CalibrationOutcome = { cameraYaml: string; refused: "" } | { cameraYaml: ""; refused: string };

const kProgressEvery_us = 500_000;
const kTryAgainAfter_us = 5_000_000;

export class CameraCalibration {
  private nextProgress = -Infinity;
  private nextTry = -Infinity;

  private constructor(
    private readonly native: NativeCalibration,
    private readonly config: CalibrationConfig,
  ) {}

  /** Throws an error if the configuration is wrong. */
  static async load(factory: WasmModuleFactory, config: CalibrationConfig, options?: object): Promise<CameraCalibration> {
    const { calibration, error } = (await factory(options)).createCalibration(config);
    if (!calibration) throw new Error(error);
    return new CameraCalibration(calibration, config);
  }

  /** As PhoneAgent.addImu. */
  addImu(utime: number, gyro: Vector3, accel: Vector3): void {
    this.native.addImu(utime, ...gyro, ...accel);
  }

  addImage(utime: number, luma: Uint8Array, stride: number): void {
    packRows(luma, this.config.width, this.config.height, stride, this.native.imageBuffer());
    this.native.addImage(utime);
  }

  /** The progress at the image of `utime`; undefined for most images, because it is computed seldom. */
  progressAt(utime: number): CalibrationProgress | undefined {
    if (utime < this.nextProgress) return undefined;
    this.nextProgress = utime + kProgressEvery_us;
    return this.native.progress();
  }

  /** Solves if the motion suffices. After a refusal it waits before it tries again. */
  tryAt(utime: number, { share }: CalibrationProgress): CalibrationOutcome | undefined {
    if (share < 1 || utime < this.nextTry) return undefined;
    this.nextTry = utime + kTryAgainAfter_us;
    return this.solve();
  }

  /** Solves with the data that there are. */
  solve(): CalibrationOutcome {
    return this.native.solve();
  }
}
