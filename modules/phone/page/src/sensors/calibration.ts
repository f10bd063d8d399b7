// The calibration of this phone's camera: the stored one, or a rough one for any phone, with standard deviations that are
// large enough.

import { Matrix4 } from "three";
import { stringify } from "yaml";
import { forget, store, stored, storedKeys } from "../storage";
import { cameraInBody } from "./axes";
import { cameraExtrinsics, distortionOf, numbersOf, sensorFields } from "./sensor_file";

export interface CameraKind {
  label: string; // of the MediaStreamTrack
  width: number; // of the delivered images, pixels
  height: number;
  angle_deg: number; // screen.orientation.angle, by which the browser rotates images upright
}

// Shares of the longer side: the main cameras of phones see 60 to 70 degrees along it.
const kFocal = 0.78;
const kFocalSigma = 0.08;
const kCentreSigma = 0.01;

const kPrefix = "pangea.calibration.";
const keyOf = ({ label, width, height, angle_deg }: CameraKind) => `${kPrefix}${label}.${width}x${height}.${angle_deg}`;

// Of the same images, or of those of a screen that is rotated otherwise.
export function storedCalibration(kind: CameraKind): string | undefined {
  const { width, height, angle_deg } = kind;
  for (const angle of [0, 90, 180, 270].map((more) => (angle_deg + more) % 360)) {
    const isSideways = (angle - angle_deg) % 180 !== 0;
    const other = { ...kind, angle_deg: angle, ...(isSideways && { width: height, height: width }) };
    const yaml = stored(keyOf(other));
    if (yaml !== undefined) return angle === angle_deg ? yaml : rotated(yaml, other, kind);
  }
  return undefined;
}

// False if the browser does not keep it.
export const storeCalibration = (kind: CameraKind, cameraYaml: string) => store(keyOf(kind), cameraYaml);

export const storedCalibrations = () => storedKeys(kPrefix).length;

// Forgets the calibrations of all cameras.
export function forgetCalibrations() {
  for (const key of storedKeys(kPrefix)) forget(key);
}

// The calibration for the same camera's images as a browser gives them for another rotation of the screen. Which rows are exposed first
// is not known then, so all count as exposed with the middle one.
function rotated(yaml: string, from: CameraKind, to: CameraKind): string {
  const file = "the stored calibration";
  const fields = sensorFields(yaml, file, "cam0");
  const angle = ((to.angle_deg - from.angle_deg) / 180) * Math.PI; // about the optical axis
  const [c, s] = [Math.round(Math.cos(angle)), Math.round(Math.sin(angle))];
  const rotate = ([x, y]: number[]) => [c * x + s * y, c * y - s * x];
  const swap = ([x, y]: number[]) => (c === 0 ? [y, x] : [x, y]);
  const middle = ({ width, height }: CameraKind) => [(width - 1) / 2, (height - 1) / 2];
  const [fx, fy, cx, cy] = numbersOf(fields, file, "intrinsics", 4);
  const centre = rotate([cx - middle(from)[0], cy - middle(from)[1]]);
  const { model, coefficients: [k1, k2, p1, p2] } = distortionOf(fields, file);
  const [q2, q1] = model === "equidistant" ? [p2, p1] : rotate([p2, p1]); // the tangential distortion is a vector (p2, p1)
  const sigmas = fields.intrinsics_sigma === undefined ? undefined : numbersOf(fields, file, "intrinsics_sigma", 4);
  return stringify({
    ...fields,
    T_BS: { cols: 4, rows: 4, data: cameraExtrinsics(fields, file).multiply(new Matrix4().makeRotationZ(angle)).transpose().toArray() },
    resolution: [to.width, to.height],
    intrinsics: [...swap([fx, fy]), middle(to)[0] + centre[0], middle(to)[1] + centre[1]],
    ...(sigmas && { intrinsics_sigma: [...swap(sigmas.slice(0, 2)), ...swap(sigmas.slice(2))] }),
    distortion_model: model,
    [fields.distortion_coeffs ? "distortion_coeffs" : "distortion_coefficients"]: [k1, k2, q1, q2],
    ...(fields.timeshift_cam_imu === undefined && { time_offset_s: Number(fields.time_offset_s ?? 0) + Number(fields.readout_s ?? 0) / 2 }),
    readout_s: 0,
  });
}

// The rough calibration as the text of a cam0/sensor.yaml.
export function roughCalibration({ width, height, angle_deg }: CameraKind): string {
  const longer = Math.max(width, height);
  const focal = kFocal * longer;
  const [focalSigma, centreSigma] = [kFocalSigma * focal, kCentreSigma * longer].map((value) => value.toFixed(1));
  const rows = cameraInBody(angle_deg).map((row) => `${row.join(", ")}, 0`);
  return `sensor_type: camera
comment: rough, of no particular phone
T_BS:
  cols: 4
  rows: 4
  data: [${rows.join(",\n         ")},
         0, 0, 0, 1]
resolution: [${width}, ${height}]
camera_model: pinhole
intrinsics: [${focal.toFixed(1)}, ${focal.toFixed(1)}, ${(width - 1) / 2}, ${(height - 1) / 2}]
distortion_model: radial-tangential
distortion_coefficients: [0, 0, 0, 0]
time_offset_s: 0
readout_s: 0.02
rotation_sigma: [0.02, 0.02, 0.02]
translation_sigma: 0.05
time_offset_sigma: 0.03
intrinsics_sigma: [${focalSigma}, ${focalSigma}, ${centreSigma}, ${centreSigma}]
`;
}

// The text of an imu0/sensor.yaml. Browsers give 60 Hz, rounded to 0.1 m/s^2 and 0.1 deg/s. The rounding is like white noise of
// 0.029 m/s^2 and 0.0005 rad/s per sample (the step over the root of 12). Times the root of the period, it is added to the phone's own
// noise density.
export const kPhoneImu = `sensor_type: imu
comment: a phone's, as browsers deliver it
T_BS:
  cols: 4
  rows: 4
  data: [1, 0, 0, 0,
         0, 1, 0, 0,
         0, 0, 1, 0,
         0, 0, 0, 1]
rate_hz: 60
gyroscope_noise_density: 0.0003
gyroscope_random_walk: 0.00003
accelerometer_noise_density: 0.005
accelerometer_random_walk: 0.003
gyroscope_scale_sigma: 0.01
accelerometer_scale_sigma: 0.01
axes_sigma: 0.01
`;
