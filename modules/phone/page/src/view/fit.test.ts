import assert from "node:assert/strict";
import { test } from "node:test";
import { Fit } from "./fit";

test("a wide image covers a tall view, its middle in the middle", () => {
  const fit = new Fit({ width: 640, height: 480 }, { width: 360, height: 720 });
  assert.equal(fit.scale, 1.5);
  assert.deepEqual(fit.toScreen([319.5, 239.5]), [180, 360]);
  assert.deepEqual(fit.toScreen([-0.5, -0.5]), [-300, 0]);
});

test("a tap finds the pixel that is drawn there", () => {
  const fit = new Fit({ width: 480, height: 640 }, { width: 1280, height: 800 });
  const [u, v] = fit.toPixel(fit.toScreen([12, 345]));
  assert.ok(Math.abs(u - 12) < 1e-9 && Math.abs(v - 345) < 1e-9);
});
