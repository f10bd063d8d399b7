import assert from "node:assert/strict";
import { test } from "node:test";
import { brightnessOf, imageOfFrame, lumaOfRgba } from "./luma";

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

// A browser in which frames can be drawn, and a frame of 8 x 4 pixels as the sensor has them.
function installBrowser() {
  class FakeCanvas {
    constructor(readonly width: number, readonly height: number) {}
    getContext() {
      return { canvas: this, drawImage: () => {}, getImageData: (_x: number, _y: number, width: number, height: number) => ({ data: new Uint8ClampedArray(4 * width * height) }) };
    }
    transferToImageBitmap() {
      return { width: this.width, height: this.height };
    }
  }
  Object.assign(globalThis, { OffscreenCanvas: FakeCanvas, createImageBitmap: async () => ({ width: 8, height: 4 }) });
}

const frameOf = (more: object) => ({
  format: "NV12", visibleRect: { width: 8, height: 4 }, displayWidth: 8, displayHeight: 4, rotation: 0, flip: false,
  allocationSize: () => 48, copyTo: async () => [{ offset: 0, stride: 8 }], ...more,
}) as unknown as VideoFrame;

test("a rotated or flipped frame is drawn, which makes it upright", async () => {
  installBrowser();
  const sizeOf = async (more: object) => {
    const { luma, width, height, stride, picture } = await imageOfFrame(frameOf(more));
    return [luma.length, width, height, stride, picture.width, picture.height];
  };
  assert.deepEqual(await sizeOf({}), [32, 8, 4, 8, 8, 4]);
  const upright = [32, 4, 8, 4, 4, 8];
  assert.deepEqual(await sizeOf({ rotation: 90, displayWidth: 4, displayHeight: 8 }), upright);
  assert.deepEqual(await sizeOf({ rotation: undefined, displayWidth: 4, displayHeight: 8 }), upright); // browsers without the attribute
  for (const more of [{ rotation: 180 }, { flip: true }]) {
    const { copyTo: _, ...frame } = frameOf(more); // copying would leave it as it is
    assert.equal((await imageOfFrame(frame as VideoFrame)).luma.length, 32);
  }
});
