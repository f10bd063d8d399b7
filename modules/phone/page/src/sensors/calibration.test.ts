import assert from "node:assert/strict";
import { test } from "node:test";
import { Matrix4, Vector3 } from "three";
import { parseCamera, project } from "../view/camera_model";
import { kPhoneImu, roughCalibration, storeCalibration, storedCalibration } from "./calibration";
import { imuExtrinsics } from "./sensor_file";

test("a rough calibration is read as a camera that looks out of the back", () => {
  for (const [width, height, angle_deg] of [[480, 640, 0], [640, 480, 90], [640, 480, 270]]) {
    const camera = parseCamera(roughCalibration({ label: "", width, height, angle_deg }), "rough");
    const ahead = new Vector3(0, 0, 1).transformDirection(camera.T_body_cam);
    assert.ok(ahead.distanceTo(new Vector3(0, 0, -1)) < 1e-9);
    assert.ok(Math.abs(camera.T_body_cam.determinant() - 1) < 1e-9);
    assert.deepEqual(project(camera, new Vector3(0, 0, 1)), [(width - 1) / 2, (height - 1) / 2]);
    // The field of view along the longer side is 65 degrees.
    const edge = Math.tan((32.5 / 180) * Math.PI);
    const [u, v] = project(camera, width > height ? new Vector3(edge, 0, 1) : new Vector3(0, edge, 1))!;
    assert.ok(Math.abs(Math.max(u, v) - 639) < 6, `${u}, ${v}`);
  }
});

test("the IMU is the body", () => {
  assert.ok(imuExtrinsics(kPhoneImu, "imu").equals(new Matrix4()));
});

// A browser's storage.
const kept = new Map<string, string>();
Object.assign(globalThis, {
  localStorage: { getItem: (key: string) => kept.get(key) ?? null, setItem: (key: string, text: string) => kept.set(key, text) },
});

const kLandscape = `T_BS:
  cols: 4
  rows: 4
  data: [0.01, -0.9999, 0, 0.03, -0.9999, -0.01, 0, -0.06, 0, 0, -1, -0.004, 0, 0, 0, 1]
resolution: [640, 480]
intrinsics: [501, 499, 311.5, 246]
intrinsics_sigma: [1, 2, 3, 4]
distortion_model: radial-tangential
distortion_coefficients: [0.11, -0.21, 0.003, -0.002]
time_offset_s: 0.012
readout_s: 0.02
`;

// Rotates an image by 90 degrees so many times: where the pixel of the first is in the second.
function rotatePixel([u, v]: [number, number], times: number, { width, height }: { width: number; height: number }): [number, number] {
  return times === 0 ? [u, v] : rotatePixel([height - 1 - v, u], times - 1, { width: height, height: width });
}

test("a calibration serves for all rotations of the screen: a point is at the same place of the rotated image", () => {
  const kind = { label: "back", width: 640, height: 480, angle_deg: 90 };
  storeCalibration(kind, kLandscape);
  const known = parseCamera(kLandscape, "known");
  const p_body = new Vector3(0.5, 0.3, -2);
  const pixelOf = (camera: typeof known) => project(camera, p_body.clone().applyMatrix4(camera.T_body_cam.clone().invert()))!;
  for (const [angle_deg, times] of [[0, 1], [180, 3], [270, 2], [90, 0]]) {
    const size = times % 2 === 1 ? { width: 480, height: 640 } : { width: 640, height: 480 };
    const yaml = storedCalibration({ label: "back", ...size, angle_deg })!;
    const camera = parseCamera(yaml, "rotated");
    assert.deepEqual([camera.width, camera.height], [size.width, size.height]);
    const [u, v] = pixelOf(camera);
    const expected = rotatePixel(pixelOf(known), times, known);
    assert.ok(Math.hypot(u - expected[0], v - expected[1]) < 1e-9, `${angle_deg}: ${[u, v]} is not ${expected}`);
    if (times > 0) assert.match(yaml, /time_offset_s: 0.022\nreadout_s: 0\n/);
    if (times === 1) assert.match(yaml.replace(/\s+/g, " "), /intrinsics_sigma: - 2 - 1 - 4 - 3/);
  }
  assert.equal(storedCalibration({ ...kind, label: "front" }), undefined);
  assert.equal(storedCalibration({ ...kind, angle_deg: 0 }), undefined, "a browser that rotates no images");
});
