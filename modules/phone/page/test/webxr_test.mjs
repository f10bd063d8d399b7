// A page whose device has its own odometry: a fake of WebXR plays a rendered recording's images with their exact poses. A second page
// plays another recording as usual, with a real server. They must fuse, the second must show the anchor of the first, and each must
// show the other.

import { Matrix4, Quaternion, Vector3 } from "three";
import { check, options, run } from "../../../viewer/page/test/harness.mjs";
import { checkFused, checkShown, chooseTargets, photograph } from "./anchor_truth.mjs";
import { installFakeXr, projectionOf } from "./fake_xr.mjs";
import { noteOthers } from "./others_truth.mjs";
import { atEnd, checkEachOther, joined, openInvited, recording } from "./pair.mjs";
import { Server } from "./server.mjs";
import { Truth } from "./truth.mjs";

const kFocal = 445; // of the device's pinhole camera
const kFrame_ms = 100;

// The pose of WebXR's view (y up) for a camera in the world (z up): the inverse of src/xr/frames.ts.
function viewOf(T_world_cam) {
  const inXr = ({ x, y, z }) => new Vector3(-y, z, -x);
  const [right, down, forward] = [0, 1, 2].map((i) => inXr(new Vector3().setFromMatrixColumn(T_world_cam, i)));
  const { x, y, z, w } = new Quaternion().setFromRotationMatrix(new Matrix4().makeBasis(right, down.negate(), forward.negate()));
  const p = inXr(new Vector3().setFromMatrixPosition(T_world_cam));
  return { position: { x: p.x, y: p.y, z: p.z }, orientation: { x, y, z, w } };
}

// For each pixel of the pinhole image, the pixel of the recording's image, which has a phone's lens.
function lensMap(truth) {
  const { width, height } = truth.camera;
  const map = [];
  for (let v = 0; v < height; ++v) {
    for (let u = 0; u < width; ++u) {
      const pixel = truth.project({ x: (u - (width - 1) / 2) / kFocal, y: (v - (height - 1) / 2) / kFocal, z: 1 });
      map.push(pixel ? Math.round(10 * pixel[0]) / 10 : -1, pixel ? Math.round(10 * pixel[1]) / 10 : -1);
    }
  }
  return map;
}

// Plays every second image, with the pose of its middle row.
async function playAsXr(page, folder, truth) {
  await page.evaluate(() => {
    const input = Object.assign(document.createElement("input"), { type: "file", id: "xr_files", webkitdirectory: true, hidden: true });
    document.body.append(input);
  });
  await page.locator("#xr_files").setInputFiles(`${folder}/mav0/cam0`);
  const { width, height } = truth.camera;
  const stamps = truth.images().filter((_, i) => i % 2 === 0);
  const views = stamps.map((utime) => ({ utime, ...viewOf(truth.cameraAt(utime + truth.readout_us / 2)) }));
  await page.evaluate(async ({ views, map, width, height, projection, frame_ms }) => {
    const files = new Map([...document.getElementById("xr_files").files].map((file) => [file.name, file]));
    const from = new OffscreenCanvas(width, height).getContext("2d", { willReadFrequently: true });
    const to = new OffscreenCanvas(width, height);
    const context = to.getContext("2d");
    const out = context.createImageData(width, height);
    const sample = (data, x, y) => {
      const [i, j] = [Math.floor(x), Math.floor(y)];
      if (i < 0 || j < 0 || i >= width - 1 || j >= height - 1) return 0;
      const at = (u, v) => data[4 * (v * width + u)];
      const [a, b] = [x - i, y - j];
      return (1 - b) * ((1 - a) * at(i, j) + a * at(i + 1, j)) + b * ((1 - a) * at(i, j + 1) + a * at(i + 1, j + 1));
    };
    const load = async ({ utime, ...view }) => {
      from.drawImage(await createImageBitmap(files.get(`${utime}000.png`)), 0, 0);
      const { data } = from.getImageData(0, 0, width, height);
      for (let i = 0; i < width * height; ++i) {
        const grey = sample(data, map[2 * i], map[2 * i + 1]);
        out.data.set([grey, grey, grey, 255], 4 * i);
      }
      context.putImageData(out, 0, 0);
      return { ...view, utime, picture: await createImageBitmap(to), width, height, projection };
    };
    // Frames are ready before they are due.
    const ready = [];
    window.xrIndex = new Map(); // page's stamp: the recording's
    window.xrEnded = false;
    void (async () => {
      for (const view of views) {
        ready.push(await load(view));
        while (ready.length > 20) await new Promise((done) => setTimeout(done, 20));
      }
      window.xrLoaded = true;
    })();
    // In real time: late frames are left out; if no frame is ready, time stands still.
    let due_ms = Infinity;
    let shown;
    window.xrSource = (time) => {
      if (ready.length > 10 && due_ms === Infinity) due_ms = time;
      if (ready.length === 0 && window.xrLoaded) window.xrEnded = true;
      else if (ready.length === 0) due_ms = time;
      if (time < due_ms && !window.xrEnded) return undefined;
      for (; time >= due_ms && ready.length > 0; due_ms += frame_ms) shown = ready.shift();
      if (!shown) return undefined;
      window.xrIndex.set(Math.round(1000 * (performance.timeOrigin + time)), shown.utime);
      return shown;
    };
  }, { views, map: lensMap(truth), width, height, projection: projectionOf({ width, height, focal: kFocal }), frame_ms: kFrame_ms });
}

// Places an anchor in the first image after `utime` in which the pinhole camera sees the point.
function place(page, truth, { name, utime, p_world }) {
  const { width, height } = truth.camera;
  const pixels = truth.images().filter((_, i) => i % 2 === 0).map((time) => {
    const p = p_world.clone().applyMatrix4(truth.cameraAt(time + truth.readout_us / 2).invert());
    return [time, [(kFocal * p.x) / p.z + (width - 1) / 2, (kFocal * p.y) / p.z + (height - 1) / 2]];
  });
  return page.evaluate(([name, from, pixels]) => new Promise((done) => {
    const table = new Map(pixels);
    const look = () => {
      const shown = pangea.stage.drawn?.utime;
      const time = window.xrIndex.get(shown);
      if (!(time >= from)) return requestAnimationFrame(look);
      pangea.walk.placeAnchor(name, shown, table.get(time));
      done(true);
    };
    look();
  }), [name, utime, pixels]);
}

await run(async () => {
  const [first, second] = [1, 2].map((n) => new Truth(recording(n)));
  const targets = chooseTargets(first, second);
  const server = new Server();
  await server.start();
  const browser = await server.browser();
  const anna = await openInvited(browser, server, "Anna", (page) => page.addInitScript(installFakeXr, { frame_ms: 20 }));
  await playAsXr(anna, recording(1), first);
  await anna.locator("#name").fill("Anna");
  await anna.locator("#start").click();
  await anna.waitForFunction(() => pangea.walk?.link === "open" && pangea.walk.pose?.state === "tracking", undefined, { timeout: 120_000 });
  check("the device's odometry has joined, and the link is open", true);
  await noteOthers(anna);
  const placing = Promise.all(targets.map((target) => place(anna, first, target)));
  const ben = await joined(browser, server, "Ben", recording(2));
  void photograph(ben, `${options.out}/phone_webxr_2.png`);
  check("it places anchors", (await placing).every(Boolean));
  await anna.waitForFunction(() => window.xrEnded, undefined, { timeout: 300_000 });
  await anna.screenshot({ path: `${options.out}/phone_webxr_1.png` });
  await atEnd(ben);
  const { images, sent } = await anna.evaluate(() => ({ images: pangea.walk.numImages, sent: pangea.walk.uplink.counters }));
  check("its images became keyframes", sent.keyframes_acked > 20, `${images} images, ${sent.keyframes_acked} keyframes acknowledged`);
  await anna.waitForFunction(() => pangea.walk.pose.group, undefined, { timeout: 60_000 }).catch(() => {});
  await checkFused([anna, ben]);
  await checkShown(ben, second, targets);
  const index = new Map(await anna.evaluate(() => [...xrIndex]));
  const device = {
    page: anna, truth: first, camera: new Matrix4().makeRotationX(Math.PI),
    timeOf: (utime) => index.get(utime) && index.get(utime) + first.readout_us / 2,
  };
  await checkEachOther(device, { page: ben, truth: second });
  await browser.close();
});
