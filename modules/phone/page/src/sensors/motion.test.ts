import assert from "node:assert/strict";
import { test } from "node:test";
import type { ImuSample } from "../recording/euroc";
import { Motion } from "./motion";

// A browser that the test gives events; the phone is held upright.
const listeners = new Map<string, (event: object) => void>();
const globals = {
  addEventListener: (type: string, listener: (event: object) => void) => listeners.set(type, listener),
  removeEventListener: (type: string) => listeners.delete(type),
};
Object.assign(globalThis, globals);

const orientation = () => listeners.get("deviceorientation")!({ beta: 90, gamma: 0 });
const motion = (timeStamp: number, y: number) =>
  listeners.get("devicemotion")!({ timeStamp, accelerationIncludingGravity: { x: 0, y, z: 0 }, rotationRate: { alpha: 0, beta: 0, gamma: 0 } });

// The samples of two seconds whose first orientation comes at `orientation_ms`, or not at all.
function samplesOf(y: number, orientation_ms: number): ImuSample[] {
  const samples: ImuSample[] = [];
  const sensor = new Motion((sample) => samples.push(sample), () => {});
  for (let i = 0; i < 120; ++i) {
    if (i * 1000 / 60 >= orientation_ms) orientation();
    motion((i * 1000) / 60, y);
  }
  sensor.stop();
  return samples;
}

test("where up is negative, as on iOS, no sample has the wrong sign", () => {
  for (const y of [9.8, -9.8]) {
    const samples = samplesOf(y, 100);
    assert.ok(samples.length > 100, `${samples.length}`);
    assert.ok(samples.every(({ accel }) => accel[1] === 9.8), String(samples.find(({ accel }) => accel[1] !== 9.8)?.accel));
  }
});

test("a phone that gives no orientation has the specification's sign, a second late", () => {
  const samples = samplesOf(9.8, Infinity);
  assert.ok(Math.abs(samples.length - 60) <= 1, `${samples.length}`);
  assert.ok(samples.every(({ accel }) => accel[1] === 9.8));
});

test("listens no longer when it is stopped", () => {
  samplesOf(9.8, 0);
  assert.equal(listeners.size, 0);
});
