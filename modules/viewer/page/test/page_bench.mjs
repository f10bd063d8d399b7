// Measures how fast the page draws, the cost of a frame without the drawing itself, and the amount of data, on a synthetic
// log (pangea-viewer-bench-log) given as --log. Prints metrics, which bench/README.md explains.

import { launch, openPage, options, run, startViewer } from "./harness.mjs";

// Counts the calls to the graphics card without executing them, so that only the page's own work is measured.
function withoutDrawing() {
  const counts = (window.counts = { draws: 0, uploads: 0, bytes: 0, frames_ms: [], updates_ms: [] });
  const timed = (times, call) => (argument) => {
    const began = performance.now();
    call(argument);
    times().push(performance.now() - began);
  };
  const gl = WebGL2RenderingContext.prototype;
  for (const name of ["drawArrays", "drawElements", "drawArraysInstanced", "drawElementsInstanced"]) {
    gl[name] = () => ++counts.draws;
  }
  const upload = (name, bytesOf) => {
    const real = gl[name];
    gl[name] = function (...args) {
      ++counts.uploads;
      counts.bytes += bytesOf(...args);
      return real.apply(this, args);
    };
  };
  const floats = (length, array) => 4 * (length || array.length);
  upload("bufferData", (target, data) => data.byteLength ?? data);
  upload("bufferSubData", (target, offset, data, from, length) => floats(length, data));
  // The last three: format, type, data.
  upload("texImage2D", (...args) => args.at(-1)?.byteLength ?? 0);
  upload("texSubImage2D", (target, level, x, y, width, height) => 16 * width * height);
  const request = window.requestAnimationFrame;
  window.requestAnimationFrame = (callback) => request.call(window, timed(() => counts.frames_ms, callback));
  const message = Object.getOwnPropertyDescriptor(WebSocket.prototype, "onmessage");
  Object.defineProperty(WebSocket.prototype, "onmessage", {
    set(callback) {
      message.set.call(this, timed(() => counts.updates_ms, callback));
    },
  });
}

const state = (page) =>
  page.evaluate(() => ({
    agents: pangea.model.agents.size,
    keyframes: pangea.model.numKeyframes,
    points: pangea.model.numPoints,
    received: pangea.received(),
    now_s: pangea.model.now_s,
  }));

async function drawn(page, seconds) {
  const before = await state(page);
  const began = performance.now();
  const fps = await page.evaluate((s) => pangea.framesPerSecond(s), seconds);
  const after = await state(page);
  const took = (performance.now() - began) / 1000;
  const kB_per_s = (after.received - before.received) / 1000 / took;
  return `${after.agents} agents, ${after.keyframes} keyframes, ${after.points} points: ${fps.toFixed(1)} frames/s, ${kB_per_s.toFixed(1)} kB/s`;
}

// Per frame: CPU time of the page's thread as counted by the browser (without other work on the machine), uploads, and
// bytes allocated. Also the durations of frames and updates on this machine.
async function cost(page, seconds) {
  const session = await page.context().newCDPSession(page);
  await session.send("Performance.enable", { timeDomain: "threadTicks" });
  const cpu_s = async () =>
    (await session.send("Performance.getMetrics")).metrics.find(({ name }) => name === "TaskDuration").value;
  await session.send("HeapProfiler.startSampling", {
    samplingInterval: 4096, includeObjectsCollectedByMajorGC: true, includeObjectsCollectedByMinorGC: true,
  });
  const before = await cpu_s();
  const counts = await page.evaluate(async (s) => {
    Object.assign(counts, { draws: 0, uploads: 0, bytes: 0, frames_ms: [], updates_ms: [] });
    await pangea.framesPerSecond(s);
    return { ...counts };
  }, seconds);
  const cpu_ms = 1000 * ((await cpu_s()) - before);
  const { profile } = await session.send("HeapProfiler.stopSampling");
  await session.detach();
  const allocated = ({ selfSize, children }) => selfSize + children.reduce((sum, child) => sum + allocated(child), 0);
  const frames = counts.frames_ms.length;
  const quantiles = (times) => {
    const sorted = times.sort((a, b) => a - b);
    const at = (share) => (sorted[Math.floor(share * (sorted.length - 1))] ?? 0).toFixed(1);
    return `${at(0.5)}, ${at(0.99)} ms`;
  };
  const { keyframes, points } = await state(page);
  return `${keyframes} keyframes, ${points} points, ${(frames / seconds).toFixed(0)} frames/s; a frame: ` +
    `CPU ${(cpu_ms / frames).toFixed(2)} ms, ${(counts.draws / frames).toFixed(0)} draws, ` +
    `${(counts.uploads / frames).toFixed(1)} uploads of ${(counts.bytes / 1000 / frames).toFixed(1)} kB, ` +
    `${(allocated(profile.head) / 1000 / frames).toFixed(0)} kB allocated; median, 99 % of ` +
    `${frames} frames: ${quantiles(counts.frames_ms)}, of ${counts.updates_ms.length} updates: ${quantiles(counts.updates_ms)}`;
}

// Plays the log through, and calls `measure` before the fusion, after it, and at the end.
async function play(page, name, measure) {
  await page.waitForFunction(() => pangea.model.start !== undefined);
  const slider = page.locator("#slider");
  await slider.fill("0");
  await page.waitForTimeout(2000); // shaders are compiled
  const say = async (what) => console.log(`${name}, ${what}: ${await measure(page, 8)}`);
  await say("playing, before fusion");
  const end = await page.evaluate(() => pangea.model.start.end_s);
  await slider.fill(String(Math.floor(end - 12)));
  await page.waitForFunction((t) => pangea.model.now_s >= t, end - 11.5);
  await say("playing, all fused and solved twice a second");
  await page.waitForFunction((t) => pangea.model.now_s >= t - 0.1, end, { timeout: 60000 });
  await page.waitForTimeout(3000);
  await say("nothing moving, every frame drawn");
}

await run(async () => {
  const browser = await launch();
  const { url } = await startViewer("--log", options.log);
  const page = await openPage(browser, "about:blank");
  await page.addInitScript(withoutDrawing);
  await page.goto(url);
  await play(page, "without drawing", cost);
  await page.close();
  const { url: again } = await startViewer("--log", options.log);
  const drawing = await openPage(browser, again);
  await play(drawing, "software GL", drawn);
  const wanted = (await state(drawing)).keyframes;
  await drawing.close();
  const fresh = await openPage(browser, again);
  const began = performance.now();
  await fresh.waitForFunction((n) => pangea.model.numKeyframes === n, wanted);
  const { received } = await state(fresh);
  console.log(
    `a second browser has everything after ${((performance.now() - began) / 1000).toFixed(1)} s and ${(received / 1e6).toFixed(2)} MB`,
  );
  await browser.close();
});
