import assert from "node:assert/strict";
import { test } from "node:test";
import { Matrix4, Vector3 } from "three";
import { parseCamera, project } from "../view/camera_model";
import { kPhoneImu, roughCalibration } from "./calibration";
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
