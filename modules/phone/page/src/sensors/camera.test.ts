import assert from "node:assert/strict";
import { test } from "node:test";
import { Camera } from "./camera";

// A browser whose camera is allowed, and whose video does as it is told.
function installBrowser(play: () => Promise<void>, video: object = { requestVideoFrameCallback: () => 0 }) {
  const track = { label: "back", readyState: "live", stop: () => (track.readyState = "ended"), addEventListener: () => {} };
  const stream = { getTracks: () => [track], getVideoTracks: () => [track] };
  const globals = {
    navigator: { mediaDevices: { getUserMedia: async () => stream } },
    document: { createElement: () => ({ play, ...video }) },
    window: {},
  };
  for (const [name, value] of Object.entries(globals)) Object.defineProperty(globalThis, name, { value, configurable: true });
  return track;
}

test("a camera that gives no video is not left open", async () => {
  const track = installBrowser(async () => {
    throw new DOMException("interrupted by a new load request", "AbortError");
  });
  await assert.rejects(Camera.open(), /interrupted/);
  assert.equal(track.readyState, "ended");
  const ofOldBrowser = installBrowser(async () => {}, {});
  await assert.rejects(Camera.open(), /requestVideoFrameCallback/);
  assert.equal(ofOldBrowser.readyState, "ended");
});

test("each image of the camera is closed, those that come after its end too", async () => {
  installBrowser(async () => {});
  const frames = Array.from({ length: 6 }, (_, i) => ({ timestamp: 33_000 * i, closed: 0, close() { ++this.closed; } }));
  const readable = new ReadableStream({
    start(controller) {
      for (const frame of frames) controller.enqueue(frame);
      controller.close();
    },
  });
  const globals = {
    window: { MediaStreamTrackProcessor: true },
    MediaStreamTrackProcessor: class { readable = readable; },
    OffscreenCanvas: class { getContext() { throw new Error("no image"); } },
    createImageBitmap: async () => ({ close() {} }),
    screen: {},
  };
  for (const [name, value] of Object.entries(globals)) Object.defineProperty(globalThis, name, { value, configurable: true });
  const camera = await Camera.open();
  camera.stop();
  await new Promise((resolve) => setTimeout(resolve, 50));
  assert.deepEqual(frames.map(({ closed }) => closed), [1, 1, 1, 1, 1, 1]);
});

// As VideoCaptureCamera2.java of Chromium: "manual" keeps the exposure time, but the gain becomes that of Android's template.
test("the focus is locked, but in a dim room the image does not become darker", async ({ mock }) => {
  const lens = { focus: "continuous", gain: 16 };
  const track = {
    ...installBrowser(async () => {}),
    getCapabilities: () => ({ focusMode: ["continuous", "manual"], exposureMode: ["continuous", "manual"], iso: { min: 100, max: 3200 } }),
    applyConstraints: async ({ advanced }: { advanced: { focusMode?: string; exposureMode?: string }[] }) => {
      for (const { focusMode, exposureMode } of advanced) {
        lens.focus = focusMode ?? lens.focus;
        if (exposureMode === "manual") lens.gain = 1;
      }
    },
  };
  const mediaDevices = { getUserMedia: async () => ({ getTracks: () => [track], getVideoTracks: () => [track] }) };
  Object.defineProperty(globalThis, "navigator", { value: { mediaDevices }, configurable: true });
  mock.timers.enable({ apis: ["setTimeout"] });
  await Camera.open();
  mock.timers.tick(2000);
  await new Promise(setImmediate);
  assert.deepEqual(lens, { focus: "manual", gain: 16 });
});

test("a camera that another app uses is named, not the browser's error", async () => {
  installBrowser(async () => {});
  const getUserMedia = async () => {
    throw new DOMException("Could not start video source", "NotReadableError");
  };
  Object.defineProperty(globalThis, "navigator", { value: { mediaDevices: { getUserMedia } }, configurable: true });
  await assert.rejects(Camera.open(), /close the app or tab that uses it/);
});

test("a page that the browser does not trust is told why there is no camera", async () => {
  installBrowser(async () => {});
  Object.defineProperty(globalThis, "navigator", { value: {}, configurable: true });
  await assert.rejects(Camera.open(), /gives this page no camera.*certificate/);
});
