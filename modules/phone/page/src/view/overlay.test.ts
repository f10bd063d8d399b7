import assert from "node:assert/strict";
import { test } from "node:test";
import type { PhonePose, Pose7 } from "../agent/phone_agent";
import { roughCalibration } from "../sensors/calibration";
import { parseCamera } from "./camera_model";
import { thingsBefore } from "./overlay";
import type { Thing } from "./overlay";

const camera = parseCamera(roughCalibration({ label: "", width: 480, height: 640, angle_deg: 0 }), "rough");
const half = Math.SQRT1_2;
// The phone is held upright at (1, 2, 1.5) and its back camera looks along odom's +y: the body's y is up, its z is -y.
const pose: PhonePose = {
  utime: 1, state: "tracking", reason: "", map: "1/1", fused: false, numTracked: 100,
  T_odom_body: [1, 2, 1.5, half, 0, 0, half],
};
const at = (name: string, x: number, y: number, z: number): Thing => ({ name, owner: 1, T_odom_thing: [x, y, z, 0, 0, 0, 1] as Pose7 });

test("what is ahead is in the middle, what is higher and more to the right is there too", () => {
  const [near, far] = thingsBefore(camera, pose, [at("far", 2, 7, 2.5), at("near", 1, 4, 1.5)]);
  assert.equal(near.name, "near");
  assert.deepEqual(near.pixel.map((value) => Math.round(2 * value) / 2), [239.5, 319.5]);
  assert.ok(Math.abs(near.distance_m - 2) < 1e-9);
  assert.ok(far.pixel[0] > 239.5 + 50 && far.pixel[1] < 319.5 - 50, `${far.pixel}`);
});

test("what is behind is left out", () => {
  assert.deepEqual(thingsBefore(camera, pose, [at("behind", 1, 0, 1.5)]), []);
});
