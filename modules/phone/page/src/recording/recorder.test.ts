import assert from "node:assert/strict";
import { test } from "node:test";
import { unzipSync } from "fflate";
import type { CameraImage } from "../sensors/camera";
import { Recorder } from "./recorder";

// A browser that cannot encode the images whose width is 0.
class FakeCanvas {
  constructor(readonly width: number, readonly height: number) {}
  getContext() {
    return { drawImage: () => {} };
  }
  async convertToBlob() {
    if (this.width === 0) throw new DOMException("out of memory", "EncodingError");
    return new Blob(["jpeg"]);
  }
}
Object.assign(globalThis, { OffscreenCanvas: FakeCanvas });

const image = (utime: number, width: number) => ({ utime, width, height: 480 }) as CameraImage;

test("an image that cannot be encoded is left out, and the rest is kept", async () => {
  const recorder = new Recorder("walk", "camera: 1\n", "imu: 1\n");
  recorder.addImage(image(1000, 640));
  recorder.addImage(image(2000, 0));
  recorder.addImage(image(3000, 640));
  const zip = await recorder.finish();
  const names = Object.keys(unzipSync(new Uint8Array(await zip.arrayBuffer()))).filter((name) => name.endsWith(".jpg"));
  assert.deepEqual(names, ["walk/mav0/cam0/data/1000000.jpg", "walk/mav0/cam0/data/3000000.jpg"]);
  assert.deepEqual([recorder.numImages, recorder.numLeftOut], [2, 1]);
});
