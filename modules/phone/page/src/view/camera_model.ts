// The camera model of a sensor.yaml, only for drawing: it projects points of the camera frame. Formulas and conventions are those of
// core/camera_model.h: z forward, x right, y down; the centre of the top-left pixel is (0, 0).

import { Matrix4 } from "three";
import { cameraExtrinsics, distortionOf, numbersOf, sensorFields } from "../sensors/sensor_file";

export interface CameraModel {
  model: "radial-tangential" | "equidistant";
  width: number; // pixels
  height: number;
  intrinsics: [number, number, number, number]; // fx fy cx cy, pixels
  distortion: [number, number, number, number]; // k1 k2 p1 p2, or k1 to k4
  T_body_cam: Matrix4;
  readout_s: number; // from the first row to the last; 0: a global shutter
}

// `T_rig_body`: from the IMU to the rig's frame.
export function parseCamera(text: string, file: string, T_rig_body = new Matrix4()): CameraModel {
  const fields = sensorFields(text, file, "cam0");
  const { model, coefficients } = distortionOf(fields, file);
  const [width, height] = numbersOf(fields, file, "resolution", 2);
  return {
    model,
    width,
    height,
    intrinsics: numbersOf(fields, file, "intrinsics", 4) as CameraModel["intrinsics"],
    distortion: coefficients,
    T_body_cam: T_rig_body.clone().invert().multiply(cameraExtrinsics(fields, file)),
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
