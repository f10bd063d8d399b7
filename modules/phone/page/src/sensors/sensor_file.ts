// The fields of a sensor.yaml, or of Kalibr's camchain and IMU files in its place, as modules/recording reads them.

import { Matrix4 } from "three";
import { parse } from "yaml";

export type Fields = Record<string, unknown>;

const isMap = (value: unknown): value is Fields => typeof value === "object" && value !== null && !Array.isArray(value);

// The fields of "cam0" or "imu0". A file of Kalibr may have an entry for each sensor.
export function sensorFields(text: string, file: string, sensor: "cam0" | "imu0"): Fields {
  // Files of Kalibr and OpenCV may begin with %YAML:1.0, which is not valid YAML.
  const fields: unknown = parse(text.replace(/^%YAML[^\n]*\n/, ""));
  if (!isMap(fields)) throw new Error(`${file}: this is no list of fields`);
  const sensors = Object.keys(fields).filter((name) => /^(cam|imu)\d+$/.test(name) && isMap(fields[name]));
  if (sensors.length === 0) return fields;
  if (!sensors.includes(sensor)) throw new Error(`${file}: there is no sensor '${sensor}' in it, but ${sensors.join(", ")}`);
  return fields[sensor] as Fields;
}

export function numbersOf(fields: Fields, file: string, key: string, count: number): number[] {
  const value = fields[key];
  if (!Array.isArray(value) || value.length !== count || !value.every((v) => Number.isFinite(v))) {
    throw new Error(`${file}: field '${key}' must be ${count} numbers`);
  }
  return value as number[];
}

// EuRoC's matrices have their numbers in `data`; Kalibr's are lists of rows.
function transformOf(fields: Fields, file: string, key: string): Matrix4 {
  const value = fields[key];
  const data = isMap(value) ? value : { data: Array.isArray(value) ? value.flat() : value };
  return new Matrix4().set(...(numbersOf(data, `${file}, ${key}`, "data", 16) as Parameters<Matrix4["set"]>));
}

// From the camera to the rig's frame: EuRoC's T_BS, or the inverse of Kalibr's T_cam_imu.
export function cameraExtrinsics(fields: Fields, file: string): Matrix4 {
  if (fields.T_BS === undefined && fields.T_cam_imu !== undefined) return transformOf(fields, file, "T_cam_imu").invert();
  if (fields.T_BS === undefined) throw new Error(`${file}: field 'T_BS' is missing`);
  return transformOf(fields, file, "T_BS");
}

// From the IMU to the rig's frame. Kalibr's IMU is the rig.
export function imuExtrinsics(text: string, file: string): Matrix4 {
  const fields = sensorFields(text, file, "imu0");
  if (fields.rate_hz === undefined && fields.update_rate !== undefined) return new Matrix4();
  if (fields.T_BS === undefined) throw new Error(`${file}: field 'T_BS' is missing`);
  return transformOf(fields, file, "T_BS");
}

const kModels = new Map([
  ["radial-tangential", "radial-tangential"], ["radtan", "radial-tangential"], ["plumb_bob", "radial-tangential"],
  ["equidistant", "equidistant"], ["equi", "equidistant"],
] as const);

export type Distortion = { model: "radial-tangential" | "equidistant"; coefficients: [number, number, number, number] };

export function distortionOf(fields: Fields, file: string): Distortion {
  const name = fields.distortion_model as "radtan";
  const model = kModels.get(name);
  if (!model) throw new Error(`${file}: field 'distortion_model' must be radial-tangential or equidistant, not '${name}'`);
  const key = fields.distortion_coeffs === undefined ? "distortion_coefficients" : "distortion_coeffs";
  const values = fields[key];
  const hasFifth = Array.isArray(values) && values.length === 5;
  const coefficients = numbersOf(fields, file, key, hasFifth ? 5 : 4);
  if (hasFifth && coefficients[4] !== 0) throw new Error(`${file}: field '${key}' has a fifth number, ${coefficients[4]}; it must be 0`);
  return { model, coefficients: coefficients.slice(0, 4) as Distortion["coefficients"] };
}
