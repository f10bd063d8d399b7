import assert from "node:assert/strict";
import { test } from "node:test";
import { brightnessOf, lumaOfRgba } from "./luma";

test("grey stays as it is, colours are weighed", () => {
  const greys = Uint8ClampedArray.from({ length: 4 * 256 }, (_, i) => (i % 4 === 3 ? 255 : i >> 2));
  assert.deepEqual([...lumaOfRgba(greys)], [...Array(256).keys()]);
  const [red, green, blue] = lumaOfRgba(new Uint8ClampedArray([255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255]));
  assert.deepEqual([red, green, blue], [77, 149, 29]);
});

test("brightness leaves out what lies between width and stride", () => {
  const luma = new Uint8Array(64 * 32).map((_, i) => (i % 64 < 32 ? 100 : 255));
  assert.equal(brightnessOf({ luma, width: 32, height: 32, stride: 64 }), 100);
});
