// Runs the calibration in its own Web Worker, so that its memory is freed with the worker.

import type { WasmModuleFactory } from "../agent/phone_agent";
import { kImuStride } from "../messages";
import { CameraCalibration } from "./camera_calibration";
import type { CalibrationOutcome } from "./camera_calibration";
import type { FromCalibration, ToCalibration } from "./messages";

const kModule = "/pangea_agent.mjs"; // beside the page

const say = (message: FromCalibration) => postMessage(message);
const fail = (error: Error) => say({ kind: "failed", text: String(error.message ?? error) });

function sayOutcome({ cameraYaml, refused }: CalibrationOutcome) {
  say(refused === "" ? { kind: "done", cameraYaml } : { kind: "refused", text: refused });
}

function addImu(calibration: CameraCalibration, samples: Float64Array) {
  for (let i = 0; i < samples.length; i += kImuStride) {
    const [utime, gx, gy, gz, ax, ay, az] = samples.subarray(i, i + kImuStride);
    calibration.addImu(utime, [gx, gy, gz], [ax, ay, az]);
  }
}

function addImage(calibration: CameraCalibration, utime: number, luma: Uint8Array, stride: number) {
  calibration.addImage(utime, luma, stride);
  const progress = calibration.progressAt(utime);
  if (progress) {
    say({ kind: "progress", progress });
    const outcome = calibration.tryAt(utime, progress);
    if (outcome) sayOutcome(outcome);
  }
  say({ kind: "taken", utime });
}

function take(calibration: CameraCalibration, message: Exclude<ToCalibration, { kind: "open" }>) {
  switch (message.kind) {
    case "imu":
      return addImu(calibration, message.samples);
    case "image":
      return addImage(calibration, message.utime, message.luma, message.stride);
    case "finish":
      return sayOutcome(calibration.solve());
  }
}

let calibration: Promise<CameraCalibration> | undefined;

onmessage = ({ data }: MessageEvent<ToCalibration>) => {
  if (data.kind === "open") {
    calibration = import(/* @vite-ignore */ kModule).then((module: { default: WasmModuleFactory }) =>
      CameraCalibration.load(module.default, data.config));
    calibration.catch(fail);
  } else {
    // Messages that come while the module is loading wait, in order.
    calibration?.then((opened) => take(opened, data)).catch(fail);
  }
};
