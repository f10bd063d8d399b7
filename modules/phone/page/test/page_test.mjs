// Tests the page in headless Chromium with a fake agent (fake_agent.mjs) and with camera and motion emulated by the browser: drawing,
// tapping, recording, interruptions, and playing the recording.

import { readFile } from "node:fs/promises";
import { unzipSync, zipSync } from "fflate";
import { PNG } from "pngjs";
import { becomes, check, launch, openPage, options, run } from "../../../viewer/page/test/harness.mjs";
import {
  hasOneNewAgent, kCameras, kPhone, screenshot, senseMotion, serve, stopAndClose, testBrokenImage, told, watchCameras,
} from "./page_tools.mjs";

async function testLive(browser, url) {
  const page = await openPage(browser, url, { ...kPhone, hasTouch: true });
  await screenshot(page, "welcome");
  check("nothing is wider than a phone", await page.evaluate(() => document.documentElement.scrollWidth <= 360));
  await page.setViewportSize({ width: 320, height: 454 });
  const bottom = await page.evaluate(() => document.getElementById("welcome").getBoundingClientRect().bottom);
  check("nothing of the panel is below a small phone's screen", bottom <= 454, bottom);
  await page.setViewportSize(kPhone.viewport);
  await senseMotion(page);
  await page.locator("#start").click();
  await testCalibration(page);

  await becomes(page, "camera images reach the agent", () => pangea.walk?.vio?.counters.images > 20);
  await becomes(page, "motion reaches the agent", () => pangea.walk.vio.counters.imu > 20);
  const { imu, range, cameraYaml } = await told(page);
  const expected = [0.5, 0, -0.25, 0, 9.8, 0.3];
  check("in rad/s and m/s^2", imu.every((value, i) => Math.abs(value - expected[i]) < 0.06), String(imu));
  check("the image has something in it", range[1] - range[0] > 100, String(range));
  check("the calibration is used", /fake, with the rotation [-\d.,]+/.test(cameraYaml), cameraYaml.split("\n")[0]);
  await testBrokenImage(page);
  await testAnchor(page);
  const zip = await testRecording(page);
  await page.locator("#stop").click();
  check("stopping leads back", await page.locator("#welcome").isVisible());
  await testKeptCalibration(page);
  await stopAndClose(page);
  return zip;
}

async function testCalibration(page) {
  await becomes(page, "an unknown camera is calibrated first: the ring fills", () =>
    document.getElementById("ring").checkVisibility() && document.getElementById("ring").getAttribute("aria-valuenow") > 0);
  await becomes(page, "the hint says what to do", () => /steering wheel/.test(document.getElementById("hint").textContent));
  await screenshot(page, "calibrating");
  await becomes(page, "then the agent starts, without the ring", () => pangea.walk && !document.getElementById("ring").checkVisibility());
}

async function testKeptCalibration(page) {
  await page.evaluate(() => (pangea.walk.isOld = true));
  await page.locator("#start").click();
  await becomes(page, "the next start has the calibration", () => !pangea.walk?.isOld && pangea.walk?.vio?.counters.images > 2);
  const { cameraYaml } = await told(page);
  check("of this camera", /^comment: fake/.test(cameraYaml));
  await page.locator("#stop").click();
  await page.locator("#recalibrate").click();
  await page.locator("#start").click();
  await becomes(page, "it can be made anew", () => Boolean(pangea.calibration));
  await page.locator("#skip").click();
  await becomes(page, "or be skipped", () => pangea.walk?.vio?.counters.images > 2);
  check("for a rough one", /rough, of no particular phone/.test((await told(page)).cameraYaml));
  await page.locator("#stop").click();
  await testDroppedCalibration(page);
}

// A sensor.yaml that is dropped while the camera is calibrated is used at once.
async function testDroppedCalibration(page) {
  await page.evaluate(() => (pangea.walk.isOld = true));
  await page.locator("#start").click();
  await becomes(page, "a calibration to be replaced starts", () => Boolean(pangea.calibration));
  await page.evaluate(() => {
    const yaml = `comment: dropped
T_BS: {cols: 4, rows: 4, data: [1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1]}
resolution: [640, 480]
intrinsics: [500, 500, 320, 240]
distortion_model: radial-tangential
distortion_coefficients: [0, 0, 0, 0]
`;
    const entry = { isFile: true, fullPath: "/sensor.yaml", file: (done) => done(new File([yaml], "sensor.yaml")) };
    const event = Object.assign(new Event("drop"), { dataTransfer: { items: [{ webkitGetAsEntry: () => entry }] } });
    dispatchEvent(event);
    window.droppedAt = performance.now();
  });
  await becomes(page, "by one that is dropped", () => !pangea.walk?.isOld && pangea.walk?.vio?.counters.images > 2);
  check("which is used", /^comment: dropped/.test((await told(page)).cameraYaml));
  await page.locator("#stop").click();
  await page.locator("#recalibrate").click();
}

// Plays the recording that was made, after changing its files.
async function playChanged(page, zip, change) {
  const files = unzipSync(new Uint8Array(await readFile(zip)));
  for (const name of Object.keys(files)) if (name.endsWith("sensor.yaml")) change(files, name);
  const buffer = Buffer.from(zipSync(files));
  await page.locator("#zip").setInputFiles({ name: "a.zip", mimeType: "application/zip", buffer });
}

// A recording without its calibration is calibrated.
async function testUncalibrated(browser, url, zip) {
  const page = await openPage(browser, `${url}#rate=max`);
  await playChanged(page, zip, (files, name) => delete files[name]);
  await becomes(page, "a recording without calibration is calibrated, then played", () => pangea.walk?.vio?.counters.images > 2);
  check("with a rotation that nobody knew", /fake, with the rotation unknown/.test((await told(page)).cameraYaml));
  await becomes(page, "from its begin to its end", () =>
    /100 %/.test(document.getElementById("numbers").textContent) && pangea.walk.numImages > 15);
  await page.close();
}

// The agent or the calibration fails with a bug.
async function testBroken(browser, url, zip) {
  for (const what of ["agent", "calibration"]) {
    const page = await openPage(browser, `${url}#rate=max`);
    await playChanged(page, zip, (files, name) => {
      if (name.includes("imu0")) files[name] = Buffer.concat([files[name], Buffer.from("\n# breaks\n")]);
      else if (what === "calibration") delete files[name];
    });
    await becomes(page, `where the ${what} breaks the page says so, and is as before`, () =>
      document.getElementById("notice").textContent === "a bug" && document.getElementById("welcome").checkVisibility());
    await page.close();
  }
}

async function testAnchor(page) {
  await testQuietHint(page);
  await becomes(page, "somebody else's anchor is named", () =>
    [...document.querySelectorAll("#labels span")].some(({ textContent }) => /^kettle · 3\.\d m$/.test(textContent)));
  await becomes(page, "the hint says who", () => document.getElementById("hint").textContent.startsWith("In one map with Ben and Anna"));
  const [drawn, expected] = await page.evaluate(() => {
    const { walk, stage } = pangea;
    const { utime, anchors } = stage.drawn;
    const [fx, , cx, cy] = walk.camera.intrinsics;
    return [anchors[0].pixel, [cx - (fx * walk.pose.T_odom_body[0]) / 3, cy], utime];
  });
  const error = Math.hypot(drawn[0] - expected[0], drawn[1] - expected[1]);
  check("it is where it belongs in the image", error < 2, `${error.toFixed(2)} px`);
  await testOther(page);
  await page.mouse.click(90, 300);
  await page.locator("#anchor_name").fill(`tap ${"名".repeat(20)}`);
  await screenshot(page, "place");
  await page.locator("#anchor_dialog [value=place]").click();
  await becomes(page, "a tap places an anchor", () => JSON.parse(pangea.walk.vio.text).edits.length === 1);
  const { edits: [edit] } = await told(page);
  // 360 x 720 shows the middle of 640 x 480, 1.5 times as large.
  const [u, v] = [(90 + 300) / 1.5 - 0.5, 300 / 1.5 - 0.5];
  check("with as much of its name as fits in 50 bytes", edit.name === `tap ${"名".repeat(15)}`, edit.name);
  check("at the pixel that was tapped", Math.hypot(edit.pixel[0] - u, edit.pixel[1] - v) < 0.1, String(edit.pixel));
}

// A screen reader reads the hint when it is set, so it must be set only when it changes.
async function testQuietHint(page) {
  const numSet = await page.evaluate(async () => {
    const hint = document.getElementById("hint");
    const texts = [];
    const observer = new MutationObserver(() => texts.push(hint.textContent));
    observer.observe(hint, { childList: true, characterData: true, subtree: true });
    await new Promise((done) => setTimeout(done, 2000));
    observer.disconnect();
    return texts.filter((text, i) => text === texts[i - 1]).length;
  });
  check("a hint that stays is set once", numSet === 0, numSet);
}

// The other agent's camera is at (1, 4, 1.5) in odom, and this agent walks along x.
async function testOther(page) {
  await becomes(page, "somebody else is named", () =>
    /^Ben · \d\.\d m$/.test(document.querySelector("#labels .person")?.textContent));
  const [drawn, expected] = await page.evaluate(() => {
    const { walk, stage } = pangea;
    const [fx, , cx, cy] = walk.camera.intrinsics;
    return [stage.drawn.others[0].pixel, [cx + (fx * (1 - walk.pose.T_odom_body[0])) / 4, cy]];
  });
  const error = Math.hypot(drawn[0] - expected[0], drawn[1] - expected[1]);
  check("and where it belongs in the image", error < 2, `${error.toFixed(2)} px`);
  const { colour, x, y } = await page.evaluate((pixel) => {
    const [x, y] = pangea.stage.screenOf(pangea.walk.camera, pixel);
    return { colour: getComputedStyle(document.querySelector("#labels .person")).borderLeftColor, x, y };
  }, drawn);
  const { data } = PNG.sync.read(await page.screenshot({ clip: { x: x - 40, y: y - 40, width: 80, height: 45 } }));
  const [r, g, b] = colour.match(/\d+/g).map(Number);
  const edges = [...Array(data.length / 4).keys()].filter((i) => Math.hypot(data[4 * i] - r, data[4 * i + 1] - g, data[4 * i + 2] - b) < 40);
  check("as a frustum", edges.length > 50, `${edges.length} pixels of ${colour}`);
}

async function testRecording(page) {
  await page.locator("#record").click();
  await becomes(page, "images are recorded", () => pangea.walk.recorder?.numImages > 20);
  const asked = page.waitForEvent("dialog", { timeout: 5000 }).catch(() => undefined);
  await page.evaluate(() => void setTimeout(() => location.reload()));
  const dialog = await asked;
  check("a page that records asks before it is left", dialog?.type() === "beforeunload");
  await dialog?.dismiss();
  const downloading = page.waitForEvent("download");
  await page.locator("#record").click();
  const zip = `${options.out}/phone_recorded.zip`;
  await (await downloading).saveAs(zip);
  return zip;
}

async function testInterruptions(browser, url) {
  const page = await openPage(browser, url, kPhone, (page) => page.addInitScript(watchCameras, {}));
  await senseMotion(page);
  await page.locator("#start").click();
  await becomes(page, "a calibration to be interrupted starts", () => Boolean(pangea.calibration));
  await page.evaluate(() => (hide(true), hide(false)));
  await hasOneNewAgent(page, "then an agent to be interrupted");
  check("the screen is kept on, also if the page was hidden meanwhile", (await page.evaluate(() => numAwake())) === 1);
  await recordsUntil(page, "a rotated screen", () => page.evaluate(() => rotate()));
  await hasOneNewAgent(page, "and starts anew");
  check("the screen is kept on, once", (await page.evaluate(() => numAwake())) === 1);
  await recordsUntil(page, "a failure", () => page.evaluate(() => pangea.walk.removeAnchor("breaks")));
  await becomes(page, "and leads back", () => document.getElementById("welcome").checkVisibility());
  await page.locator("#start").click();
  await hasOneNewAgent(page, "one can start again");
  await recordsUntil(page, "a camera that is taken away", () => page.evaluate(() => streams.at(-1).getVideoTracks()[0].dispatchEvent(new Event("ended"))));
  await becomes(page, "and leads back, and is named", () =>
    document.getElementById("welcome").checkVisibility() && /took the camera away/.test(document.getElementById("notice").textContent));
  await page.locator("#start").click();
  await hasOneNewAgent(page, "after which one can start too");
  await page.evaluate(() => streams.at(-1).getVideoTracks()[0].stop());
  await becomes(page, "a camera that gives no more images is named", () =>
    /^The camera gives no images/.test(document.getElementById("hint").textContent), undefined, 10_000);
  await page.locator("#stop").click();
  await page.locator("#start").click();
  await hasOneNewAgent(page, "after which one can start as well");
  await recordsUntil(page, "Stop", () => page.locator("#stop").click());

  await page.locator("#start").click();
  await hasOneNewAgent(page, "one can start after Stop");
  await page.evaluate(() => (rotate(), rotate()));
  await hasOneNewAgent(page, "a screen rotated there and back starts once");
  await page.context().setOffline(true);
  await page.evaluate(() => rotate());
  await hasOneNewAgent(page, "without network a rotated screen starts anew too");
  await page.context().setOffline(false);
  await page.evaluate(() => {
    window.whileOpening = () => document.getElementById("stop").click();
    rotate();
  });
  await becomes(page, "Stop while the camera is opened leads back", () => document.getElementById("welcome").checkVisibility());
  await page.waitForTimeout(1000);
  check("and stays there, without camera and agent",
    await page.evaluate(() => numCameras() === 0 && !pangea.walk && document.getElementById("welcome").checkVisibility()));
  check("and the screen may go off", (await page.evaluate(() => numAwake())) === 0);
  await testDamagedCalibration(page);
  await page.close();
}

// A stored calibration of the camera that is damaged. The visitor can make it anew.
async function testDamagedCalibration(page) {
  await page.evaluate(() => {
    window.whileOpening = undefined;
    for (const key of Object.keys(localStorage)) if (key.startsWith("pangea.calibration.")) localStorage.setItem(key, "resolution: 7");
  });
  await page.locator("#start").click();
  await becomes(page, "a damaged calibration is named", () =>
    /^the stored calibration: field/.test(document.getElementById("notice").textContent) && document.getElementById("recalibrate").checkVisibility());
  check("and the camera is closed", (await page.evaluate(() => numCameras())) === 0);
}

// What ends a walk saves its recording.
async function recordsUntil(page, what, end) {
  await page.locator("#record").click();
  await page.waitForFunction(() => pangea.walk.recorder?.numImages > 5);
  const downloading = page.waitForEvent("download", { timeout: 10_000 }).catch(() => undefined);
  await end();
  check(`${what} saves the recording`, Boolean(await downloading));
  check("and resets its button", (await page.locator("#record").textContent()) === "Record");
}

async function testPlaying(browser, url, zip) {
  const page = await openPage(browser, `${url}#rate=max`, { colorScheme: "dark" });
  await screenshot(page, "welcome_dark");
  await page.locator("#zip").setInputFiles(zip);
  await becomes(page, "what was recorded is played to its end", () =>
    /100 %/.test(document.getElementById("numbers").textContent) && pangea.walk.vio.counters.images > 10);
  const { imu } = await told(page);
  check("with its motion", Math.abs(imu[0] - 0.5) < 0.01 && Math.abs(imu[4] - 9.8) < 0.06, String(imu));
  await becomes(page, "the end ends the map", () => pangea.walk.numImages === pangea.walk.vio.counters.images);
  await screenshot(page, "playing_dark");
  await page.close();
}

await run(async () => {
  const url = await serve();
  const browser = await launch(kCameras);
  const zip = await testLive(browser, url);
  await testInterruptions(browser, url);
  await testPlaying(browser, url, zip);
  await testUncalibrated(browser, url, zip);
  await testBroken(browser, url, zip);
  await browser.close();
}, /ERR_INTERNET_DISCONNECTED/);
