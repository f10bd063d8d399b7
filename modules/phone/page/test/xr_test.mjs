// Tests the page as page_test.mjs does, on a device with its own odometry, which fake_xr.mjs fakes.

import { becomes, check, launch, openPage, run } from "../../../viewer/page/test/harness.mjs";
import { installFakeXr, projectionOf } from "./fake_xr.mjs";
import { kCameras, screenshot, senseMotion, serve, told } from "./page_tools.mjs";

// A device with its own odometry looks along odom's y from a height of 1.5 m; the lower and the right part of its image are darker.
async function testXr(browser, url) {
  const page = await openPage(browser, url, { viewport: { width: 360, height: 480 }, permissions: ["camera", "accelerometer", "gyroscope"] }, async (page) => {
    await page.addInitScript(installFakeXr, { frame_ms: 33 });
    await page.addInitScript(countSamplers);
  });
  await page.evaluate((projection) => {
    const picture = new OffscreenCanvas(960, 1280);
    const context = picture.getContext("2d");
    for (const [grey, x, y] of [[200, 0, 0], [150, 480, 0], [100, 0, 640], [50, 480, 640]]) {
      context.fillStyle = `rgb(${grey} ${grey} ${grey})`;
      context.fillRect(x, y, 480, 640);
    }
    const lens = { picture, width: 960, height: 1280, projection };
    const half = Math.SQRT1_2;
    window.xrSource = () => ({ ...lens, ...window.xrSize, ...(!window.xrLost && { position: { x: 0, y: 1.5, z: 0 }, orientation: { x: 0, y: half, z: 0, w: half } }) });
  }, projectionOf({ width: 960, height: 1280, focal: 1000 }));
  await stopBeforeFirstImage(page);
  await page.locator("#start").click();
  await becomes(page, "WebXR: the device's images reach the agent", () => pangea.walk?.vio?.counters.images > 5);
  const { cameraYaml, edges } = await told(page);
  check("its camera too, smaller", /resolution: \[480, 640\]/.test(cameraYaml) && /intrinsics: \[500\.000, 500\.000, 239\.500, 319\.500\]/.test(cameraYaml));
  const expected = { top: 200, bottom: 100, left: 200, right: 150 };
  check("the image is upright and exact", Object.entries(expected).every(([side, grey]) => Math.abs(edges[side] - grey) <= 1), JSON.stringify(edges));
  await becomes(page, "an anchor and somebody else are drawn", () => pangea.stage.drawn?.anchors.length > 0 && pangea.stage.drawn.others.length > 0);
  const [T, pixel, other] = await page.evaluate(() => [pangea.walk.pose.T_odom_body, pangea.stage.drawn.anchors[0].pixel, pangea.stage.drawn.others[0].pixel]);
  check("with its pose, z up", Math.hypot(T[0], T[1], T[2] - 1.5) < 1e-6, String(T));
  check("an anchor and somebody else are where they belong", Math.hypot(pixel[0] - 239.5, pixel[1] - 319.5) < 0.1 && Math.hypot(other[0] - 364.5, other[1] - 319.5) < 0.1, `${pixel}, ${other}`);
  check("nothing is recorded without motion", !(await page.locator("#record").isVisible()));
  await screenshot(page, "webxr");
  await page.evaluate(() => (window.xrLost = true));
  await becomes(page, "the hint says when the device is lost", () => /^Lost/.test(document.getElementById("hint").textContent));
  await page.evaluate(() => (window.xrLost = false));
  await becomes(page, "and goes on when it is not", () => pangea.walk.pose.state === "tracking");
  await testXrRotations(page);
  await page.locator("#stop").click();
  check("stopping ends the session", (await page.locator("#welcome").isVisible()) && (await page.evaluate(() => xrSession.ended)));
  check("and frees what it had on the graphics card", (await page.evaluate(() => numSamplers)) === 0);
  await page.evaluate(() => (window.xrLost = true));
  await page.locator("#start").click();
  await becomes(page, "the next start waits for AR, too, and shows nothing of the last walk", () =>
    /AR finds its way/.test(document.getElementById("hint").textContent));
  await page.locator("#stop").click();
  await page.close();
}

// Only what reads the device's camera has samplers.
function countSamplers() {
  window.numSamplers = 0;
  const { prototype } = WebGL2RenderingContext;
  for (const [name, more] of [["createSampler", 1], ["deleteSampler", -1]]) {
    const real = prototype[name];
    prototype[name] = function (...given) {
      window.numSamplers += more;
      return real.apply(this, given);
    };
  }
}

// Stop in AR before the first image does not mean that AR gives no images.
async function stopBeforeFirstImage(page) {
  await page.evaluate(() => (window.xrLost = true));
  await page.locator("#start").click();
  await becomes(page, "WebXR: one waits until AR finds its way", () => /AR finds its way/.test(document.getElementById("hint").textContent));
  await page.locator("#stop").click();
  check("and may stop", await page.evaluate(() => xrSession.ended && document.getElementById("welcome").checkVisibility()));
  await page.evaluate(() => (window.xrLost = false));
}

// The screen is rotated there and back while the first agent ends, which takes a second here.
async function testXrRotations(page) {
  await page.evaluate(async () => {
    const { postMessage } = Worker.prototype;
    Worker.prototype.postMessage = function (message, transfer) {
      setTimeout(() => postMessage.call(this, message, transfer), message.kind === "close" ? 1000 : 0);
    };
    pangea.walk.isOld = true;
    window.xrSize = { width: 1280, height: 960 };
    await new Promise((done) => setTimeout(done, 500));
    window.xrSize = undefined;
  });
  await becomes(page, "a rotated screen starts anew", () => !pangea.walk.isOld && pangea.walk.vio?.counters.images > 5);
  check("with one agent", page.workers().length === 1, page.workers().length);
}

async function testXrRefused(browser, url) {
  const page = await openPage(browser, url, { viewport: { width: 360, height: 480 }, permissions: ["camera", "accelerometer", "gyroscope"] }, (page) => page.addInitScript(installFakeXr, { frame_ms: 33, refusedFeature: "camera-access" }));
  await senseMotion(page);
  await page.locator("#start").click();
  await becomes(page, "WebXR without camera images: the page's own odometry", () => Boolean(pangea.calibration));
  await page.close();
}

// AR starts, but gives no camera images.
async function testXrBlind(browser, url) {
  const page = await openPage(browser, url, { viewport: { width: 360, height: 480 }, permissions: ["camera", "accelerometer", "gyroscope"] }, (page) => page.addInitScript(installFakeXr, { frame_ms: 33 }));
  await senseMotion(page);
  await page.evaluate((projection) => {
    window.xrBlind = true;
    window.xrSource = () => ({ width: 960, height: 1280, projection, position: { x: 0, y: 0, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 } });
  }, projectionOf({ width: 960, height: 1280, focal: 1000 }));
  await page.locator("#start").click();
  await becomes(page, "AR without camera images ends, and the page says so", () =>
    /AR gives no camera images/.test(document.getElementById("notice").textContent) && document.getElementById("welcome").checkVisibility());
  await page.locator("#start").click();
  await becomes(page, "the next start uses the page's own odometry", () => Boolean(pangea.calibration));
  await page.close();
}

await run(async () => {
  const url = await serve();
  const browser = await launch(kCameras);
  await testXr(browser, url);
  await testXrRefused(browser, url);
  await testXrBlind(browser, url);
  await browser.close();
});
