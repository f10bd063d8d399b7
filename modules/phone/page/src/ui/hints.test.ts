import assert from "node:assert/strict";
import { test } from "node:test";
import type { PhonePose } from "../agent/phone_agent";
import { calibrationHint, hintOf } from "./hints";
import type { Situation } from "./hints";

const pose: PhonePose = {
  utime: 1, state: "tracking", reason: "", map: "2/5", T_odom_body: [0, 0, 0, 0, 0, 0, 1], fused: false, numTracked: 100,
};
const good: Situation = { pose, brightness: 120, link: "open", isMemoryFull: false, together: [], motionSilent: false, cameraSilent: false };
const says = (change: Partial<Situation>) => hintOf({ ...good, ...change }).text;

test("what to do comes before what is good", () => {
  assert.match(says({ motionSilent: true }), /no motion/);
  assert.match(says({ cameraSilent: true }), /camera gives no images/);
  assert.match(says({ pose: undefined }), /Starting/);
  assert.match(says({ pose: { ...pose, state: "initialising", reason: "not enough motion yet: velocity" } }), /Move sideways/);
  const otherSize = "1280x720 pixels, but the calibration is of 640x480";
  assert.match(says({ pose: { ...pose, state: "initialising", reason: otherSize } }), /calibrate the camera again/);
  const blank = { ...pose, state: "initialising", reason: "too few features are tracked from image to image" } as const;
  assert.match(says({ pose: blank }), /more detail/);
  assert.match(says({ pose: { ...blank }, brightness: 10 }), /Too dark/);
  assert.match(says({ pose: { ...pose, state: "lost" } }), /Lost/);
  assert.match(says({ pose: { ...pose, numTracked: 10 } }), /Little to see/);
  assert.match(says({ link: "connecting", together: ["Anna"] }), /No connection/);
  assert.match(says({ link: "connecting", isMemoryFull: true }), /memory is full/);
  assert.match(says({ link: "refused" }), /new invite/);
  assert.match(says({ link: "replaced" }), /open elsewhere/);
});

test("with whom the map is one", () => {
  assert.match(says({ together: ["Anna"] }), /^In one map with Anna\./);
  assert.match(says({ together: ["Anna", "Ben", "Eva"] }), /with Anna, Ben and Eva\./);
  assert.match(says({}), /Walk where others have been/);
  assert.match(says({ link: undefined }), /^Tracking/);
});

test("a dark image that is tracked well is no trouble", () => {
  assert.doesNotMatch(says({ brightness: 10 }), /dark/);
});

test("while it calibrates: what is missing most, or why the last try was refused", () => {
  const at = { progress: { share: 0.4, missing: "time" }, refused: "", brightness: 120, motionSilent: false } as const;
  const text = (change: Partial<Parameters<typeof calibrationHint>[0]>) => calibrationHint({ ...at, ...change }).text;
  assert.match(text({}), /^Getting to know this camera.*to and fro/);
  assert.match(text({ progress: { share: 0.4, missing: "rotation about z" } }), /steering wheel/);
  assert.match(text({ progress: { share: 0.4, missing: "points" } }), /more detail/);
  assert.match(text({ progress: { share: 1, missing: "" } }), /^Calculating/);
  assert.match(text({ progress: { share: 1, missing: "" }, refused: "rotate more" }), /^Not yet: rotate more\. Go on/);
  assert.match(text({ brightness: 10 }), /Too dark/);
  assert.match(text({ motionSilent: true }), /no motion/);
});
