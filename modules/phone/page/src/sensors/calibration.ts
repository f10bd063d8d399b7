// The calibration of this phone's camera: the one that is stored for it, or one that no phone is far from, with standard
// deviations that say so.

import { cameraInBody } from "./axes";

export interface CameraKind {
  label: string; // of the MediaStreamTrack
  width: number; // pixels, as they are delivered
  height: number;
  angle_deg: number; // screen.orientation.angle, by which the browser turns images upright
}

// Of the longer side: phones' main cameras see 60 to 70 degrees along it.
const kFocal = 0.78;
const kFocalSigma = 0.08;
const kCentreSigma = 0.01;

const kPrefix = "pangea.calibration.";
const keyOf = ({ label, width, height, angle_deg }: CameraKind) => `${kPrefix}${label}.${width}x${height}.${angle_deg}`;

export const storedCalibration = (kind: CameraKind) => localStorage.getItem(keyOf(kind)) ?? undefined;
export const storeCalibration = (kind: CameraKind, cameraYaml: string) => localStorage.setItem(keyOf(kind), cameraYaml);

export const storedCalibrations = () => Object.keys(localStorage).filter((key) => key.startsWith(kPrefix)).length;

// Of all cameras.
export function forgetCalibrations() {
  for (const key of Object.keys(localStorage)) if (key.startsWith(kPrefix)) localStorage.removeItem(key);
}

// The text of a cam0/sensor.yaml.
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

// The text of an imu0/sensor.yaml. Browsers give 60 Hz, rounded to 0.1 m/s^2 and 0.1 deg/s: as white noise of a sample
// 0.029 m/s^2 and 0.0005 rad/s (a step's width over the root of 12), times the root of the period on top of a phone's own.
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
