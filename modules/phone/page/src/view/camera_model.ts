// The camera model of a sensor.yaml, only for drawing: it projects points of the camera frame. Formulas and conventions are those of
// core/camera_model.h: z forward, x right, y down; the centre of the top-left pixel is (0, 0).

import { Matrix4 } from "three";
import { parse } from "yaml";

export interface CameraModel {
  model: "radial-tangential" | "equidistant";
  width: number; // pixels
  height: number;
  intrinsics: [number, number, number, number]; // fx fy cx cy, pixels
  distortion: [number, number, number, number]; // k1 k2 p1 p2, or k1 to k4
  T_body_cam: Matrix4;
  readout_s: number; // from the first row to the last; 0: a global shutter
}

type Fields = Record<string, unknown>;

function numbers(fields: Fields, file: string, key: string, count: number): number[] {
  const value = fields[key];
  if (!Array.isArray(value) || value.length !== count || !value.every((v) => Number.isFinite(v))) {
    throw new Error(`${file}: field '${key}' must be ${count} numbers`);
  }
  return value as number[];
}

function parseFields(text: string, file: string): Fields {
  // Files of Kalibr and OpenCV may begin with %YAML:1.0, which is not valid YAML.
  const fields: unknown = parse(text.replace(/^%YAML[^\n]*\n/, ""));
  if (typeof fields !== "object" || fields === null) throw new Error(`${file}: this is no list of fields`);
  return fields as Fields;
}

// The T_BS of a camera or IMU: from the sensor to the rig's frame.
export function parseExtrinsics(text: string, file: string): Matrix4 {
  const T_BS = parseFields(text, file).T_BS;
  if (typeof T_BS !== "object" || T_BS === null) throw new Error(`${file}: field 'T_BS' is missing`);
  return new Matrix4().set(...(numbers(T_BS as Fields, file, "data", 16) as Parameters<Matrix4["set"]>));
}

// `T_rig_body`: T_BS of the IMU.
export function parseCamera(text: string, file: string, T_rig_body = new Matrix4()): CameraModel {
  const fields = parseFields(text, file);
  const model = fields.distortion_model;
  if (model !== "radial-tangential" && model !== "equidistant") {
    throw new Error(`${file}: field 'distortion_model' must be radial-tangential or equidistant, not '${model}'`);
  }
  const [width, height] = numbers(fields, file, "resolution", 2);
  return {
    model,
    width,
    height,
    intrinsics: numbers(fields, file, "intrinsics", 4) as CameraModel["intrinsics"],
    distortion: numbers(fields, file, "distortion_coefficients", 4) as CameraModel["distortion"],
    T_body_cam: T_rig_body.clone().invert().multiply(parseExtrinsics(text, file)),
    readout_s: Number.isFinite(fields.readout_s) ? (fields.readout_s as number) : 0,
  };
}

const kMaxAngle = 1.3; // rad from the axis; beyond it a distortion polynomial may fold back

// The pixel of a point of the camera frame; undefined behind the camera, or too far from its axis.
export function project(camera: CameraModel, p_cam: { x: number; y: number; z: number }): [number, number] | undefined {
  if (p_cam.z <= 1e-6) return undefined;
  const [x, y] = [p_cam.x / p_cam.z, p_cam.y / p_cam.z];
  const r2 = x * x + y * y;
  if (Math.atan(Math.sqrt(r2)) > kMaxAngle) return undefined;
  const [fx, fy, cx, cy] = camera.intrinsics;
  const [xd, yd] = camera.model === "equidistant" ? equidistant(camera, x, y, r2) : radialTangential(camera, x, y, r2);
  return [fx * xd + cx, fy * yd + cy];
}

function radialTangential({ distortion: [k1, k2, p1, p2] }: CameraModel, x: number, y: number, r2: number) {
  const radial = 1 + r2 * (k1 + r2 * k2);
  return [
    x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
    y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
  ];
}

function equidistant({ distortion: [k1, k2, k3, k4] }: CameraModel, x: number, y: number, r2: number) {
  const r = Math.sqrt(r2);
  if (r < 1e-9) return [x, y];
  const theta = Math.atan(r);
  const t2 = theta * theta;
  const scale = (theta * (1 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4))))) / r;
  return [x * scale, y * scale];
}
