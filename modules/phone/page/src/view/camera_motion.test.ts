import assert from "node:assert/strict";
import { test } from "node:test";
import { Vector3 } from "three";
import type { PhonePose, Pose7 } from "../agent/phone_agent";
import { roughCalibration } from "../sensors/calibration";
import { CameraMotion } from "./camera_motion";
import { parseCamera } from "./camera_model";
import { thingsBefore } from "./overlay";

const camera = parseCamera(roughCalibration({ label: "", width: 640, height: 480, angle_deg: 90 }), "rough");
const poseAt = (utime: number, T_odom_body: Pose7, map = "1/1"): PhonePose =>
  ({ utime, state: "tracking", reason: "", map, fused: false, numTracked: 100, T_odom_body });

// The camera frame is the body's in this test, so that directions are easy to tell.
const still = { ...camera, T_body_cam: camera.T_body_cam.clone().identity(), readout_s: 0.03 };
const turned = (angle: number): Pose7 => [0, 0, 0, 0, Math.sin(angle / 2), 0, Math.cos(angle / 2)];

test("a rotation goes on while the rows are read out", () => {
  const motion = CameraMotion.between(poseAt(0, turned(0)), poseAt(50_000, turned(0.05)), still)!; // 1 rad/s about y
  const ahead = new Vector3(0, 0, 5).applyMatrix4(motion.after(0.03));
  assert.ok(Math.abs(Math.atan2(ahead.x, ahead.z) + 0.03) < 1e-6, `${ahead.toArray()}`);
});

test("a walk goes on too", () => {
  const motion = CameraMotion.between(poseAt(0, [0, 0, 0, 0, 0, 0, 1]), poseAt(50_000, [0, 0, 0.05, 0, 0, 0, 1]), still)!; // 1 m/s
  assert.ok(Math.abs(new Vector3(0, 0, 5).applyMatrix4(motion.after(0.02)).z - 4.98) < 1e-9);
});

test("other maps, a gap and the first pose tell no motion", () => {
  const now = poseAt(50_000, turned(0.05));
  assert.equal(CameraMotion.between(undefined, now, still), undefined);
  assert.equal(CameraMotion.between(poseAt(0, turned(0), "1/2"), now, still), undefined);
  assert.equal(CameraMotion.between(poseAt(-1_000_000, turned(0)), now, still), undefined);
  assert.equal(CameraMotion.between({ ...poseAt(0, turned(0)), state: "lost" }, now, still), undefined);
});

test("a thing is drawn where its row sees it", () => {
  const before = poseAt(0, turned(0)), now = poseAt(50_000, turned(0.05));
  const motion = CameraMotion.between(before, now, still);
  const [fx, , , cy] = still.intrinsics;
  const things = (y: number) => [{ name: "", owner: 1, T_odom_thing: [0, y, 5, 0, 0, 0, 1] as Pose7 }];
  const column = (y: number, moving: boolean) => thingsBefore(still, now, things(y), moving ? motion : undefined)[0].pixel[0];
  const shift = (y: number) => column(y, false) - column(y, true);
  assert.ok(Math.abs(shift(0) / fx - (0.03 * cy) / (still.height - 1)) < 1e-3, "the middle row half of the read-out later");
  assert.ok(shift(1.5) > 1.5 * shift(0) && shift(-1.5) < 0.5 * shift(0), "lower rows later, higher rows earlier");
});
