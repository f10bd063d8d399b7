// Calibrates the camera of a recording without calibration before it is played, as the page does.

import { CameraCalibration } from "../calibration/camera_calibration";
import type { CalibrationOutcome } from "../calibration/camera_calibration";
import type { WasmModuleFactory } from "../agent/phone_agent";
import type { Recording } from "../recording/euroc";
import { lumaOf } from "./png";

const kLongest_us = 60_000_000;
const kAhead_us = 60_000; // samples are added this far ahead of images

export async function cameraYamlOf({ files, images, imu, imuYaml }: Recording, factory: WasmModuleFactory, options: object): Promise<string> {
  const { width, height } = lumaOf(await files.read(images[0].name));
  const calibration = await CameraCalibration.load(factory, { width, height, imuYaml }, options);
  let outcome: CalibrationOutcome | undefined;
  let next = 0;
  for (const { utime, name } of images.filter(({ utime }) => utime <= images[0].utime + kLongest_us)) {
    for (; next < imu.length && imu[next].utime <= utime + kAhead_us; ++next) {
      calibration.addImu(imu[next].utime, imu[next].gyro, imu[next].accel);
    }
    calibration.addImage(utime, lumaOf(await files.read(name)).luma, width);
    const progress = calibration.progressAt(utime);
    outcome = progress && calibration.tryAt(utime, progress);
    if (outcome?.cameraYaml) break;
  }
  if (!outcome?.cameraYaml) outcome = calibration.solve();
  if (outcome.refused !== "") throw new Error(`this recording does not calibrate its camera: ${outcome.refused}`);
  return outcome.cameraYaml;
}
