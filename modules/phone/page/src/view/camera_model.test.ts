import assert from "node:assert/strict";
import { test } from "node:test";
import { Matrix4, Vector3 } from "three";
import { parseCamera, project } from "./camera_model";

const yaml = (more: string) => `
T_BS:
  cols: 4
  rows: 4
  data: [0, 1, 0, 0.04, 1, 0, 0, 0.01, 0, 0, -1, -0.005, 0, 0, 0, 1]
resolution: [640, 480]
intrinsics: [445.2, 445.9, 318.4, 243.1]
${more}
`;
const phone = yaml("distortion_model: equidistant\ndistortion_coefficients: [0.021, -0.012, 0.004, -0.001]");
const euroc = yaml("distortion_model: radial-tangential\ndistortion_coefficients: [-0.28, 0.07, 0.0002, 0.00002]");

test("reads a sensor.yaml", () => {
  const camera = parseCamera(`%YAML:1.0\n${phone}`, "cam0/sensor.yaml");
  assert.equal(camera.width, 640);
  const ahead = new Vector3(0, 0, 1).applyMatrix4(camera.T_body_cam);
  assert.deepEqual(ahead.toArray(), [0.04, 0.01, -1.005]);
});

test("the rig's frame is left for the IMU's", () => {
  const T_rig_imu = new Matrix4().makeTranslation(1, 2, 3);
  const camera = parseCamera(phone, "cam0/sensor.yaml", T_rig_imu);
  const centre = new Vector3().applyMatrix4(camera.T_body_cam);
  assert.ok(centre.distanceTo(new Vector3(-0.96, -1.99, -3.005)) < 1e-12);
});

// As pangea-vio reads it. The camera looks along the body's x axis, 0.1 m before it.
const camchain = `cam0:
  camera_model: pinhole
  intrinsics: [190.9, 190.8, 254.9, 256.8]
  distortion_model: equidistant
  distortion_coeffs: [0.003, 0.0007, -0.002, 0.0002]
  resolution: [512, 512]
  T_cam_imu:
  - [0.0, -1.0, 0.0, 0.0]
  - [0.0, 0.0, -1.0, 0.0]
  - [1.0, 0.0, 0.0, -0.1]
  - [0.0, 0.0, 0.0, 1.0]
  timeshift_cam_imu: 0.002
cam1:
  camera_model: pinhole
`;

test("reads Kalibr's camchain, and its names of lens models", () => {
  const camera = parseCamera(camchain, "cam0/sensor.yaml");
  assert.deepEqual(camera.distortion, [0.003, 0.0007, -0.002, 0.0002]);
  assert.deepEqual(new Vector3(0, 0, 1).applyMatrix4(camera.T_body_cam).toArray(), [1.1, 0, 0]);
  for (const name of ["radtan", "plumb_bob"]) {
    assert.equal(parseCamera(euroc.replace("radial-tangential", name), "f").model, "radial-tangential");
  }
  assert.equal(parseCamera(phone.replace("equidistant", "equi"), "f").model, "equidistant");
  const rows = "T_BS: [[0, 1, 0, 0.04], [1, 0, 0, 0.01], [0, 0, -1, -0.005], [0, 0, 0, 1]]";
  const byRows = euroc.replace(/T_BS:[^\]]*\]/, rows).replace("0.00002]", "0.00002, 0]");
  assert.deepEqual(parseCamera(byRows, "f"), parseCamera(euroc, "f"));
  assert.throws(() => parseCamera(byRows.replace("0.00002, 0]", "0.00002, 0.1]"), "f"), /fifth number, 0.1/);
  assert.throws(() => parseCamera(camchain.replace("cam0:", "cam2:"), "f"), /no sensor 'cam0' in it, but cam2, cam1/);
});

test("what is missing is named", () => {
  const refused = (text: string, says: RegExp) => assert.throws(() => parseCamera(text, "cam0/sensor.yaml"), says);
  refused(phone.replace("equidistant", "fov"), /cam0\/sensor.yaml: field 'distortion_model'.*'fov'/);
  refused(phone.replace("resolution: [640, 480]", ""), /field 'resolution' must be 2 numbers/);
  refused(phone.replace("445.2, ", ""), /field 'intrinsics' must be 4 numbers/);
  refused(phone.replace("T_BS", "T_SB"), /field 'T_BS' is missing/);
  refused("", /no list of fields/);
});

// The expected values are from OpenCV: cv2.fisheye.projectPoints and cv2.projectPoints.
test("projects as OpenCV does", () => {
  const p = new Vector3(0.6, -0.4, 1.5);
  const near = (pixel: [number, number] | undefined, u: number, v: number) =>
    assert.ok(pixel && Math.hypot(pixel[0] - u, pixel[1] - v) < 1e-3, `${pixel} is not ${u}, ${v}`);
  near(project(parseCamera(phone, "f"), p), 485.021858, 131.844105);
  near(project(parseCamera(euroc, "f"), p), 485.607974, 131.474731);
});

test("nothing behind the camera, and nothing where a lens model folds back", () => {
  const camera = parseCamera(euroc, "f");
  assert.equal(project(camera, { x: 0, y: 0, z: -1 }), undefined);
  assert.equal(project(camera, { x: 5, y: 0, z: 1 }), undefined);
});
