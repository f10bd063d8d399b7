// Tests the page in headless Chromium, with a captured log, and with a live bus on which the log is played.
// Writes screenshots to --out; `scripts/viewer --screenshots` copies them to docs/.

import { execFileSync } from "node:child_process";
import { readFileSync, rmSync } from "node:fs";
import jsQR from "jsqr";
import { becomes, check, launch, openPage, options, run, start, startViewer } from "./harness.mjs";

const screenshot = (page, name) => page.screenshot({ path: `${options.out}/viewer_${name}.png` });

const numGroups = () =>
  new Set(pangea.model.maps.filter((m) => m && m.seqs.size > 0).map((m) => m.said.group)).size;

async function seek(page, share) {
  const box = await page.locator("#slider").boundingBox();
  await page.mouse.click(box.x + 8 + share * (box.width - 16), box.y + box.height / 2);
}

// Waits until nothing moves any more.
const settled = (page) =>
  becomes(page, "the maps stop moving", () => pangea.model.keyframes.every(
    (k) => !k.arrived || k.shown.t.distanceTo(k.target.t) < 1e-2));

async function testLog(browser) {
  const { url, viewer } = await startViewer("--log", options.log);
  const page = await openPage(browser, url);
  await becomes(page, "it connects and shows two agents", () =>
    document.querySelectorAll(".agent").length === 2);
  await page.locator("#play").click();
  await becomes(page, "the player stops", () => !pangea.model.playing);

  await seek(page, 0.2);
  await becomes(page, "the slider goes to the time before the fusion", () =>
    Math.abs(pangea.model.now_s - 0.2 * pangea.model.start.end_s) < 0.3);
  check("two maps there", (await page.evaluate(numGroups)) === 2);
  await settled(page);
  await screenshot(page, "before");

  await seek(page, 1);
  await becomes(page, "the slider goes to the end", () =>
    pangea.model.now_s > pangea.model.start.end_s - 0.3 && pangea.model.numKeyframes === 63);
  check("one map there", (await page.evaluate(numGroups)) === 1);
  check("points of both", (await page.evaluate(() => pangea.model.numPoints)) > 1000);
  // The panels follow the model a moment later.
  await becomes(page, "the fusion has its mark", () => document.querySelectorAll(".mark").length >= 1);
  await becomes(page, "health of the five processes", () => document.querySelectorAll(".process").length === 5);
  await becomes(page, "drift is told", () => /drift [\d.]+ (mm|cm|m)/.test(document.getElementById("agents").innerText));
  await becomes(page, "who is fused with whom is told", () =>
    ["one map with 2", "one map with 1"].every((said) => document.getElementById("agents").innerText.includes(said)));

  await page.locator("#show_refused").check();
  await settled(page);
  for (const accepted of [true, false]) await testHover(page, accepted);
  await testCamera(page);
  await testBeforeAfter(page);
  await screenshot(page, "fused");
  await testImages(page);
  await testThemes(page);
  await testSeekBack(page);
  await testBrokenUpdate(page);

  for (const [name, context] of [
    ["dark", { colorScheme: "dark" }],
    ["phone", { viewport: { width: 390, height: 780 }, hasTouch: true, isMobile: true }],
  ]) {
    await seek(page, 1);
    const other = await openPage(browser, url, context);
    await becomes(other, `a second browser (${name}) shows the same`, () =>
      document.querySelectorAll(".agent").length === 2 && pangea.model.numKeyframes === 63);
    check("and the same speed", (await other.locator("#speed").inputValue()) === "20");
    await settled(other);
    await other.waitForTimeout(1500);
    await screenshot(other, name);
    await other.close();
  }
  await page.close();
  viewer.removeAllListeners("exit");
  viewer.kill();
}

// An update that the page fails to show must not freeze it.
async function testBrokenUpdate(page) {
  await page.evaluate(() => {
    const { stage } = pangea;
    stage.take = () => {
      delete stage.take; // the class's own one is back
      throw new Error("broken by the test");
    };
  });
  await seek(page, 0.2);
  await becomes(page, "an update breaks the page: it lets the connection go", () =>
    document.getElementById("connection").textContent !== "");
  await becomes(page, "and connects anew", () => document.getElementById("connection").textContent === "");
  await seek(page, 1);
  await becomes(page, "and gets the rest", () => pangea.model.numKeyframes === 63);
}

// Hovering over a constraint's line must show its verification result. Lines may overlap, so any of them will do.
async function testHover(page, accepted) {
  const spots = await page.evaluate((wanted) => {
    const { model, stage } = pangea;
    return model.constraints.filter((c) => c.accepted === wanted).slice(0, 20).flatMap((c) => {
      const ends = stage.picking.onScreen(c);
      return ends ? [{ x: (ends[0].x + ends[1].x) / 2, y: (ends[0].y + ends[1].y) / 2 }] : [];
    });
  }, accepted);
  const wanted = accepted ? /^Accepted\n/ : /^Refused: \S/;
  let tip = "";
  for (const { x, y } of spots) {
    await page.mouse.move(x, y);
    tip = await page.locator("#tip").textContent();
    if (wanted.test(tip)) break;
  }
  check(`hovering over ${accepted ? "an accepted" : "a refused"} constraint tells`, wanted.test(tip),
    tip.replaceAll("\n", " | "));
  if (!accepted) await screenshot(page, "refused");
  await page.mouse.move(5, 400);
}

// The view of an agent's camera must show its tracks in its colour (the log has no images).
async function testCamera(page) {
  await page.locator('.agent[data-key="2"]').click();
  await becomes(page, "a click on an agent shows its tracks", () =>
    /^Agent 2, newest keyframe: [1-9]\d* tracks/.test(document.getElementById("view_caption").textContent));
  const painted = await page.evaluate(() => {
    const canvas = document.getElementById("view_canvas");
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    let count = 0;
    for (let i = 0; i < data.length; i += 4) count += data[i] > 180 && data[i + 2] < 60 ? 1 : 0;
    return count;
  });
  check("they are painted", painted > 100, `${painted} pixels of orange`);
  await page.waitForTimeout(1500);
  await screenshot(page, "camera");
}

// The first image is decoded after the second one.
async function testImages(page) {
  const { caption, numClosed } = await page.evaluate(async () => {
    const { createImageBitmap } = window;
    const decode = [];
    let numClosed = 0;
    window.createImageBitmap = async () => {
      await new Promise((done) => decode.push(done));
      return Object.assign(await createImageBitmap(new ImageData(4, 4)), { close: () => ++numClosed });
    };
    const view = (agent) => ({ agent, width: 4, height: 4, encoding: 2, image: new Uint8Array(1), tracks: [] });
    const drawn = [1, 2].map((agent) => pangea.drawView(view(agent)));
    for (const i of [1, 0]) {
      decode[i]();
      await drawn[i];
    }
    Object.assign(window, { createImageBitmap });
    return { caption: document.getElementById("view_caption").textContent, numClosed };
  });
  check("an image that is decoded late does not replace a newer one", caption.startsWith("Agent 2"), caption);
  check("each image is closed", numClosed === 2, numClosed);
  await page.locator("#view_close").click();
}

// What was drawn with the colours of the theme before is given back to the graphics card.
async function testThemes(page) {
  const used = () => page.evaluate(async () => {
    await pangea.framesPerSecond(0.2);
    return pangea.stage.renderer.info.memory.geometries;
  });
  const before = await used();
  for (const colorScheme of ["dark", "light", "dark", "light"]) {
    await page.emulateMedia({ colorScheme });
    await used();
  }
  const after = await used();
  check("a change of theme leaves nothing behind", after === before, `${before} geometries, then ${after}`);
}

async function testBeforeAfter(page) {
  const distance = () => page.evaluate(() => {
    const [a, b] = pangea.model.maps.filter((m) => m?.newest >= 0);
    const at = (m) => pangea.model.keyframes[m.newest].shown.t;
    return at(a).distanceTo(at(b));
  });
  const fused = await distance();
  await page.locator("#before").click();
  await becomes(page, "before fusion: the maps slide apart", (was) => {
    const [a, b] = pangea.model.maps.filter((m) => m?.newest >= 0);
    const at = (m) => pangea.model.keyframes[m.newest].shown.t;
    return Math.abs(at(a).distanceTo(at(b)) - was) > 1;
  }, fused);
  await page.locator("#after").click();
  await settled(page);
  check("and back into place", Math.abs((await distance()) - fused) < 0.05);
}

async function testSeekBack(page) {
  await seek(page, 0.5);
  await becomes(page, "the slider goes back", () => pangea.model.numKeyframes < 50);
  await page.locator("#speed").selectOption("20");
  await page.locator("#play").click();
  await becomes(page, "it plays on to the end, fast", () => pangea.model.numKeyframes === 63);
  // No click stops it: one that comes just after the end starts it anew.
  await becomes(page, "it stops at its end", () => !pangea.model.playing);
  await page.evaluate(() => {
    const slider = document.getElementById("slider");
    slider.value = "5";
    for (const event of [new Event("input"), new PointerEvent("pointercancel")]) slider.dispatchEvent(event);
  });
  await becomes(page, "a slider that is taken away seeks", () => Math.abs(pangea.model.now_s - 5) < 0.3);
  await page.evaluate(() => (document.getElementById("slider").value = "7"));
  await page.locator("#speed").selectOption("5");
  await becomes(page, "and shows the time again", () => Math.abs(document.getElementById("slider").value - 5) < 0.3, undefined, 5000);
  await page.locator("#speed").selectOption("20");
}

async function testLive(browser) {
  const bus = `udpm://239.255.76.67:${20000 + (process.pid % 30000)}?ttl=0&recv_buf_size=4194304`;
  const { url, viewer } = await startViewer("--bus", bus);
  const page = await openPage(browser, url);
  await becomes(page, "an empty bus says what it waits for", () =>
    document.getElementById("empty").textContent.startsWith("Waiting for agents on udpm:"));
  await screenshot(page, "empty");
  // Short-lived states are recorded in the page, because a busy machine would ask for them too late.
  await page.evaluate(() => {
    window.seen = { twoMaps: false, notices: [] };
    const { model } = pangea;
    const apply = model.apply;
    model.apply = function (update) {
      apply.call(this, update);
      seen.twoMaps ||= this.maps.filter((m) => m && m.seqs.size > 0 && m.said.group === m.said.index).length === 2;
    };
    const notice = document.getElementById("notice");
    new MutationObserver(() => seen.notices.push(notice.textContent)).observe(notice, { childList: true });
  });
  start(`${options.bin}/pangea-anchors`, "--bus", bus);
  start(`${options.bin}/pangea-viewer-test-journal`, bus);
  // 0.8 s of the log have two maps: a busy page would draw the next state only.
  const bothMaps_s = "2.5";
  playPart(bus, "before", "--to", bothMaps_s);
  await becomes(page, "live: two maps at first", () => seen.twoMaps);
  playPart(bus, "after", "--from", bothMaps_s);
  await becomes(page, "live: the fusion is followed and announced", () =>
    seen.notices.some((text) => text.startsWith("one map now: agents 1, 2")));
  await becomes(page, "live: every keyframe arrives", () => pangea.model.numKeyframes === 63);
  check("live: one group", (await page.evaluate(numGroups)) === 1);
  check("live: no time slider", await page.locator("#player").isHidden());
  await testPhones(page, bus);
  await testLiveAnchors(page);
  await testDisconnected(page, viewer);
}

function playPart(bus, name, ...times) {
  const part = `${options.out}/${name}.lcm`;
  rmSync(part, { force: true });
  execFileSync(`${options.bin}/pangea-log`, ["cut", options.log, ...times, "--out", part]);
  start("lcm-logplayer", "--speed=2", `--lcm-url=${bus}`, part);
}

// A change that cannot be sent is not lost silently.
async function testDisconnected(page, viewer) {
  viewer.kill();
  await becomes(page, "without the viewer it is not connected", () => document.getElementById("connection").textContent !== "");
  for (let i = 0; i < 2; ++i) await page.locator(".anchor .delete").first().click();
  await becomes(page, "and says that nothing was changed", () =>
    /^Not connected/.test(document.getElementById("notice").textContent), undefined, 5000);
  await page.close();
}

// With a gateway, the page must show where phones join, as a QR code that can be read.
async function testPhones(page, bus) {
  check("phones: without a gateway there is nothing to join", await page.locator("#phones").isHidden());
  const site = `${options.out}/site_of_phones`;
  rmSync(site, { recursive: true, force: true });
  const startGateway = (port) => start(`${options.bin}/pangea-gateway`,
    "--site", site, "--bus", bus, "--link", bus.replace("76.67", "76.68"), "--listen", "127.0.0.1", "--port", port);
  const gateway = startGateway("0");
  await becomes(page, "phones: a gateway has a button", () => !document.getElementById("phones").hidden);
  await page.locator("#phones").click();
  const { url, fingerprint } = JSON.parse(readFileSync(`${site}/gateway/address.json`, "utf8"));
  const [data, width] = await page.evaluate(() => {
    const canvas = document.getElementById("phones_code");
    return [[...canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data], canvas.width];
  });
  const read = jsQR(Uint8ClampedArray.from(data), width, width)?.data;
  check("phones: its QR code is the address", read === url, read);
  check("phones: with the certificate's fingerprint", (await page.locator("#phones_fingerprint").textContent()) === fingerprint);
  await screenshot(page, "phones");
  await page.keyboard.press("Escape");
  gateway.kill();
  await becomes(page, "phones: without the gateway the button goes", () => document.getElementById("phones").hidden, undefined, 20_000);
  for (const file of ["ca.pem", "ca.key"]) rmSync(`${site}/gateway/${file}`);
  startGateway(new URL(url).port);
  await becomes(page, "phones: another authority at the same address has its fingerprint", (old) =>
    !document.getElementById("phones").hidden && document.getElementById("phones_fingerprint").textContent !== old, fingerprint, 20_000);
}

// Pixels of map points that are not covered and are far from each other.
const pointsToClick = (count) => {
  const { model, stage } = pangea;
  const found = [];
  stage.points.forEach((k, x, y, z) => {
    const { t, q } = model.keyframes[k].shown;
    const pixel = stage.picking.pixelOf(t.clone().set(x, y, z).applyQuaternion(q).add(t));
    if (found.length === count || document.elementFromPoint(pixel?.x, pixel?.y)?.id !== "stage") return;
    if (found.every((other) => other.distanceTo(pixel) > 150)) found.push(pixel);
  });
  return found.map((pixel) => ({ x: pixel.x, y: pixel.y }));
};

async function placeAnchor(page, point, name) {
  await page.locator("#anchor_add").click();
  await page.mouse.click(point.x, point.y);
  await page.locator("#anchor_name").fill(name);
  await page.locator('#anchor_dialog button[value="place"]').click();
}

// The position of the first anchor on the stage and on the screen.
const anchorNow = () => {
  const [index] = pangea.model.anchors.keys();
  const { t } = pangea.model.anchorPose(index);
  const pixel = pangea.stage.picking.pixelOf(t);
  return { at: [t.x, t.y, t.z], x: pixel.x, y: pixel.y, revision: pangea.model.anchors.get(index).said.revision };
};
const distance = (a, b) => Math.hypot(...a.map((value, i) => value - b[i]));

// A notice stays for five seconds, also if another one was shown shortly before.
async function testNotices(page) {
  const isShown = () => page.evaluate(() => document.getElementById("notice").classList.contains("shown"));
  await page.locator("#anchor_add").click();
  await page.waitForTimeout(4000);
  const empty = await page.evaluate(() => {
    for (let y = 100; y < innerHeight; y += 20) {
      for (let x = 300; x < innerWidth; x += 20) {
        if (document.elementFromPoint(x, y)?.id === "stage" && !pangea.stage.picking.pick(x, y)) return { x, y };
      }
    }
  });
  await page.mouse.click(empty.x, empty.y);
  await becomes(page, "anchors: where no point is the page says so", () => document.getElementById("notice").textContent === "No map point there");
  await page.waitForTimeout(2000);
  check("anchors: for as long as it says other things", await isShown());
  await page.keyboard.press("Escape");
}

// The browser takes the pointer away, for instance for a gesture of the system.
async function testCancelledDrag(page) {
  const before = await page.evaluate(anchorNow);
  await page.mouse.move(before.x, before.y);
  await page.mouse.down();
  await page.mouse.move(before.x + 60, before.y + 40, { steps: 5 });
  const dragged = await page.evaluate(anchorNow);
  await page.evaluate(() => document.getElementById("stage").dispatchEvent(new PointerEvent("pointercancel", { pointerId: 1 })));
  await page.mouse.up();
  const after = await page.evaluate(anchorNow);
  check("anchors: a drag that is cancelled is undone",
    distance(dragged.at, before.at) > 0.1 && distance(after.at, before.at) < 0.01 && after.revision === before.revision);
}

async function testLiveAnchors(page) {
  await settled(page);
  await page.waitForTimeout(1500); // the camera comes to a stop
  await testNotices(page);
  const [point, ...others] = await page.evaluate(pointsToClick, 3);
  await placeAnchor(page, point, "kettle <b>");
  await becomes(page, "anchors: one that is placed is listed by its name", () =>
    document.querySelector(".anchor .name")?.textContent === "kettle <b>");
  let anchor = await page.evaluate(anchorNow);
  // The point nearest to the pointer may be a neighbour of the intended one.
  const off_px = Math.hypot(anchor.x - point.x, anchor.y - point.y);
  check("anchors: it is where it was put", off_px < 13, `${off_px.toFixed(1)} px off`);
  await page.locator(".anchor .what").click();
  await becomes(page, "anchors: the camera goes there", () =>
    pangea.stage.picking.pixelOf(pangea.model.anchorPose([...pangea.model.anchors.keys()][0]).t).distanceTo({
      x: document.getElementById("stage").clientWidth / 2, y: document.getElementById("stage").clientHeight / 2 }) < 3);
  await page.waitForTimeout(500);

  await testCancelledDrag(page);
  anchor = await page.evaluate(anchorNow);
  await page.mouse.move(anchor.x, anchor.y);
  await page.mouse.down();
  await page.mouse.move(anchor.x - 60, anchor.y - 40, { steps: 5 });
  const dragged = await page.evaluate(anchorNow);
  await page.mouse.up();
  check("anchors: it follows the pointer", distance(dragged.at, anchor.at) > 0.1 &&
    Math.hypot(dragged.x - anchor.x + 60, dragged.y - anchor.y + 40) < 2, `${distance(dragged.at, anchor.at)} m`);
  await becomes(page, "anchors: the server has moved it", () => [...pangea.model.anchors.values()][0].said.revision === 2);
  const moved = await page.evaluate(anchorNow);
  check("anchors: it stays where it was dragged", distance(moved.at, dragged.at) < 0.01,
    `${(1000 * distance(moved.at, dragged.at)).toFixed(1)} mm off`);

  await page.locator('.anchor[data-key="0"] .delete').click();
  check("anchors: deleting asks", (await page.locator(".anchor .delete").textContent()) === "delete?");
  await page.locator('.anchor[data-key="0"] .delete').click();
  await becomes(page, "anchors: it is gone", () => pangea.model.anchors.size === 0);

  await page.locator("#fit").click();
  await page.waitForTimeout(2500);
  for (const [i, name] of ["kettle", "window", "door"].entries()) await placeAnchor(page, [point, ...others][i], name);
  await becomes(page, "anchors: three more", () => document.querySelectorAll(".anchor").length === 3);
  await page.mouse.move(5, 400);
  await becomes(page, "anchors: what was said is hidden again", () =>
    !document.getElementById("notice").classList.contains("shown"));
  await page.waitForTimeout(500);
  // The processes at the bottom are silent: the log is at its end.
  const { y } = await page.locator("footer").boundingBox();
  await page.screenshot({ path: `${options.out}/viewer_anchors.png`, clip: { x: 0, y: 0, width: 1280, height: y } });
}

// The anchors of a log are shown and listed, but cannot be changed.
async function testAnchorsOfLog(page) {
  await becomes(page, "anchors: the log's ten are listed", () => document.querySelectorAll(".anchor").length === 10);
  check("anchors: nobody changes a log's",
    await page.evaluate(() => document.getElementById("anchor_add").hidden &&
      [...document.querySelectorAll(".anchor .delete")].every((button) => button.hidden)));
  await settled(page);
  const off = await page.evaluate(() => {
    const { model } = pangea;
    const { said, holder } = model.anchors.get(0);
    const { shown, solved } = model.keyframes[holder];
    const [x, y, z] = said.T_map_anchor;
    const at = model.anchorPose(0).t;
    // A single group is not shifted, so the stage's frame is the map frame.
    return Math.hypot(at.x - x, at.y - y, at.z - z) + shown.t.distanceTo(solved.T_map_body.t);
  });
  check("anchors: they are where the log has them", off < 0.03, `${off} m off`);
  await page.locator('.anchor[data-key="3"] .what').click();
  await becomes(page, "anchors: a click flies there", () => {
    const at = pangea.stage.picking.pixelOf(pangea.model.anchorPose(3).t);
    const canvas = document.getElementById("stage");
    return Math.hypot(at.x - canvas.clientWidth / 2, at.y - canvas.clientHeight / 2) < 3;
  });
  await becomes(page, "anchors: names stand beside them", () =>
    [...document.querySelectorAll(".anchor_label")].some((label) => !label.hidden && label.textContent === "anchor 3"));
  await page.mouse.move(5, 400);
  await page.waitForTimeout(300);
  await screenshot(page, "anchors_of_log");
  await testOtherAnchors(page);
  await page.locator("#show_anchors").uncheck();
  await becomes(page, "anchors: they can be hidden", () =>
    [...document.querySelectorAll(".anchor_label")].every((label) => label.hidden));
  await seek(page, 0.2);
  await becomes(page, "anchors: before they were made there are none", () =>
    pangea.model.anchors.size === 0 && document.getElementById("anchors").hidden);
}

// Another time of the log may have as many anchors, with other names. The speed makes the server send something.
async function testOtherAnchors(page) {
  await page.evaluate(() => {
    const { model } = pangea;
    const none = { maps: [], agents: [], constraints: [], processes: [], fusions: [], keyframes: [], solved: [] };
    const { start, now_s, playing, speed, leftOut: left_out } = model;
    const jump = (suffix) => {
      const anchors = [...model.anchors.values()].map(({ said }) => ({ ...said, name: said.name + suffix }));
      model.apply({ ...none, start, now_s, playing, speed, left_out, anchors });
    };
    jump("");
    Object.assign(window, { jump });
  });
  const names = () => page.evaluate(() => document.querySelector(".anchor .name").textContent);
  await page.locator("#speed").selectOption("2");
  await page.waitForTimeout(500);
  await page.evaluate(() => window.jump(" of another time"));
  await page.locator("#speed").selectOption("5");
  await page.waitForTimeout(500);
  check("anchors: the list follows a jump in time", /of another time$/.test(await names()), await names());
}

// All cards are completely visible without scrolling.
const allCardsInSight = () => {
  const list = document.getElementById("agents");
  return document.querySelectorAll(".agent").length === 12 &&
    list.scrollHeight <= list.clientHeight && list.scrollWidth <= list.clientWidth;
};

async function testTwelve(browser) {
  const log = `${options.out}/twelve_agents.lcm`;
  execFileSync(`${options.bin}/pangea-viewer-bench-log`, [log, "12", "20", "5"]);
  const { url } = await startViewer("--log", log);
  const page = await openPage(browser, url);
  await page.locator("#slider").waitFor();
  await seek(page, 1);
  await becomes(page, "twelve agents: their keyframes come", () => pangea.model.numKeyframes === 240);
  check("twelve agents: it is one", (await page.evaluate(numGroups)) === 1);
  await becomes(page, "twelve agents: all their cards are in sight", allCardsInSight);
  await testAnchorsOfLog(page);
}

await run(async () => {
  const browser = await launch();
  await testLog(browser);
  await testLive(browser);
  await testTwelve(browser);
  await browser.close();
}, /broken by the test|ERR_CONNECTION_REFUSED/);
