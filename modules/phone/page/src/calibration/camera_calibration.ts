// A camera calibrated while somebody moves it, compiled to WebAssembly (modules/phone/agent/camera_calibration.h). One thread: in a
// page, a Web Worker. Times are microseconds.

import type { NativeCalibration, Vector3, WasmModuleFactory } from "../agent/phone_agent";
import { packRows } from "../sensors/luma";

export interface CalibrationConfig {
  /** Of the images, pixels. */
  width: number;
  height: number;
  /** The text of mav0/imu0/sensor.yaml. */
  imuYaml: string;
  /** x, y, z, w of the rotation camera to body, where it is known to some degrees. */
  q_body_cam?: [number, number, number, number];
}

export interface CalibrationProgress {
  /** Of what suffices, 0 to 1. */
  share: number;
  /** What is missing most; nothing when it suffices. */
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

  /** Throws what is wrong with the configuration. */
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

  /** How far it is with the image of `utime`; nothing to say at most images. */
  progressAt(utime: number): CalibrationProgress | undefined {
    if (utime < this.nextProgress) return undefined;
    this.nextProgress = utime + kProgressEvery_us;
    return this.native.progress();
  }

  /** Solves when there is enough, and not again at once where that was refused. */
  tryAt(utime: number, { share }: CalibrationProgress): CalibrationOutcome | undefined {
    if (share < 1 || utime < this.nextTry) return undefined;
    this.nextTry = utime + kTryAgainAfter_us;
    return this.solve();
  }

  /** With what there is. */
  solve(): CalibrationOutcome {
    return this.native.solve();
  }
}
