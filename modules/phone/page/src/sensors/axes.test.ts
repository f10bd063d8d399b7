import assert from "node:assert/strict";
import { test } from "node:test";
import { cameraInBody, GravitySign, toBody, upInBody } from "./axes";
import type { Matrix3, Vector3 } from "./axes";

const near = (a: readonly number[], b: readonly number[], tolerance = 1e-9) =>
  a.forEach((value, i) => assert.ok(Math.abs(value - b[i]) < tolerance, `${a} is not ${b}`));
const column = (m: Matrix3, i: number): Vector3 => [m[0][i], m[1][i], m[2][i]];

test("rates are degrees about x, y, z; specific force points up", () => {
  const { gyro, accel } = toBody({ acceleration: [0, 0, 9.8], rate: [180, 90, -45] }, 1);
  near(gyro, [Math.PI, Math.PI / 2, -Math.PI / 4]);
  near(accel, [0, 0, 9.8]);
});

test("a platform with gravity downwards is turned over", () => {
  near(toBody({ acceleration: [0, 0, -9.8], rate: [0, 0, 0] }, -1).accel, [0, 0, 9.8]);
});

test("up: flat on a table, held upright, on its right edge", () => {
  near(upInBody(0, 0), [0, 0, 1]);
  near(upInBody(90, 0), [0, 1, 0]);
  near(upInBody(0, 90), [-1, 0, 0]);
});

test("the sign is found from readings that have gravity in them, and kept", () => {
  const ios = new GravitySign();
  assert.equal(ios.sign, 1);
  ios.add([0, 0, -1], [0, 0, 1]); // in free fall there is no gravity to measure
  assert.equal(ios.sign, 1);
  for (let i = 0; i < 10; ++i) ios.add([0, -9.7, -0.5], upInBody(88, 2));
  assert.ok(ios.decided);
  assert.equal(ios.sign, -1);
  for (let i = 0; i < 100; ++i) ios.add([0, 9.7, 0], [0, 1, 0]);
  assert.equal(ios.sign, -1);
});

test("the camera looks out of the back in every orientation, its image upright on the screen", () => {
  // The image's right and down directions in the device's axes.
  const cases: [number, Vector3, Vector3][] = [
    [0, [1, 0, 0], [0, -1, 0]], // upright
    [90, [0, -1, 0], [-1, 0, 0]], // on its left side: the device's top points left
    [180, [-1, 0, 0], [0, 1, 0]], // upside down
    [270, [0, 1, 0], [1, 0, 0]], // on its right side
  ];
  for (const [angle, right, down] of cases) {
    const R_body_cam = cameraInBody(angle);
    near(column(R_body_cam, 0), right);
    near(column(R_body_cam, 1), down);
    near(column(R_body_cam, 2), [0, 0, -1]);
  }
});
