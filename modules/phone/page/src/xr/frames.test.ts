import assert from "node:assert/strict";
import { test } from "node:test";
import { Matrix4, PerspectiveCamera, Vector3, Vector4 } from "three";
import { parseCamera, project } from "../view/camera_model";
import { matrixOf } from "../view/poses";
import { cameraYamlOf, odomPose } from "./frames";

const near = (a: Vector3, b: Vector3, tolerance: number) => assert.ok(a.distanceTo(b) < tolerance, `${a.toArray()} is not ${b.toArray()}`);

test("up is z, and forward is x", () => {
  const T = matrixOf(odomPose({ position: { x: 1, y: 2, z: 3, w: 1 } as DOMPointReadOnly, orientation: { x: 0, y: 0, z: 0, w: 1 } as DOMPointReadOnly }));
  near(new Vector3().applyMatrix4(T), new Vector3(-3, -1, 2), 1e-12);
  near(new Vector3(0, 1, 0).transformDirection(T), new Vector3(0, 0, 1), 1e-12);
  near(new Vector3(0, 0, -1).transformDirection(T), new Vector3(1, 0, 0), 1e-12);
});

// For any camera, also with a principal point off the middle, a point must be in the image where three.js has it on the screen.
test("a point of the world is at the pixel where WebXR draws it", () => {
  const view = new PerspectiveCamera(60, 0.75, 0.1, 100);
  view.setViewOffset(1000, 1300, 20, 40, 900, 1200);
  view.position.set(0.3, 1.4, -0.2);
  view.rotation.set(-0.2, 0.7, 0.1);
  view.updateMatrixWorld();
  const size = { width: 480, height: 640 };
  const camera = parseCamera(cameraYamlOf(view.projectionMatrix.elements, size), "xr");
  const p_xr = new Vector3(0.1, 0.2, -3).applyMatrix4(view.matrixWorld);

  const clip = new Vector4(p_xr.x, p_xr.y, p_xr.z, 1).applyMatrix4(view.matrixWorldInverse).applyMatrix4(view.projectionMatrix);
  const expected = [((clip.x / clip.w + 1) / 2) * size.width - 0.5, ((1 - clip.y / clip.w) / 2) * size.height - 0.5];

  const q = view.quaternion;
  const T_odom_body = matrixOf(odomPose({ position: view.position as unknown as DOMPointReadOnly, orientation: q as unknown as DOMPointReadOnly }));
  const p_odom = new Vector3(-p_xr.z, -p_xr.x, p_xr.y);
  const T_cam_odom: Matrix4 = T_odom_body.multiply(camera.T_body_cam).invert();
  const pixel = project(camera, p_odom.applyMatrix4(T_cam_odom));
  assert.ok(pixel && Math.hypot(pixel[0] - expected[0], pixel[1] - expected[1]) < 0.01, `${pixel} is not ${expected}`);
});
