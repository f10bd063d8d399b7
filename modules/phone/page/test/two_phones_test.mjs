// Two pages that play rendered phones, by invite, over TLS, at a real server with its gateway, beside an agent that is a program:
// they fuse; page 1 places an anchor on something of the scene; page 2 shows it where that is in its own images.

import { check, openPage, options, run } from "../../../viewer/page/test/harness.mjs";
import { Server } from "./server.mjs";
import { Truth } from "./truth.mjs";

const kPlace_s = [8, 16]; // of recording 1, when the anchor is placed
const kDistance_m = [1.2, 5];
const kMaxError_px = 10;

// What page 1 will tap: a point of the scene that recording 2 has longest in view afterwards.
function chooseTarget(first, second) {
  const tracks = first.tracks();
  const observations = new Map();
  for (const [utime, points] of tracks) {
    for (const { id, pixel } of points) {
      if (!observations.has(id)) observations.set(id, []);
      observations.get(id).push({ utime, pixel });
    }
  }
  const began = first.poses[0].utime;
  const later = second.poses.filter((_, i) => i % 20 === 0).slice(second.poses.length / 40).map(({ utime }) => utime);
  let best;
  for (const [utime, points] of tracks) {
    const at_s = (utime - began) / 1e6;
    if (at_s < kPlace_s[0] || at_s > kPlace_s[1] || Math.round(at_s * 20) % 10 !== 0) continue;
    for (const { id, pixel } of points) {
      if (observations.get(id).length < 20 || pixel[0] < 100 || pixel[0] > 540 || pixel[1] < 80 || pixel[1] > 400) continue;
      const p_world = first.triangulate(observations.get(id));
      const distance = p_world.distanceTo(first.rayOf(pixel, utime).from);
      if (distance < kDistance_m[0] || distance > kDistance_m[1]) continue;
      const seen = later.filter((time) => second.pixelOf(p_world, time)).length;
      if (!best || seen > best.seen) best = { utime, pixel, p_world, distance, seen };
    }
  }
  return best;
}

// Notes, of every image that page shows, where it has drawn anchors.
const noteDrawn = (page) => page.evaluate(() => {
  window.noted = [];
  const look = () => {
    const { drawn } = pangea.stage;
    if (drawn && drawn.utime !== noted.at(-1)?.utime) noted.push(structuredClone(drawn));
    requestAnimationFrame(look);
  };
  look();
});

// Taps, so to say, in the image of `utime` and no other.
const placeAt = (page, { utime, pixel }) => page.evaluate(([when, where]) => new Promise((done) => {
  const look = () => {
    const shown = pangea.stage.drawn?.utime;
    if (shown >= when) {
      pangea.walk.placeAnchor("bench", when, where);
      return done(shown === when);
    }
    requestAnimationFrame(look);
  };
  look();
}), [utime, pixel]);

async function joined(browser, server, name, recording) {
  const page = await openPage(browser, server.invite(name), { viewport: { width: 960, height: 720 } });
  await page.locator("#name").fill(name);
  await page.locator("#folder").setInputFiles(recording);
  await page.waitForFunction(() => pangea.walk?.link === "open", undefined, { timeout: 60_000 });
  check(`${name} has joined and the link is open`, true);
  await noteDrawn(page);
  return page;
}

const median = (values) => [...values].sort((a, b) => a - b)[Math.floor(values.length / 2)];

// Errors in page 2's images, and how many images had the anchor in view.
async function errorsIn(page, truth, p_world) {
  const noted = await page.evaluate(() => noted);
  const errors = [];
  for (const { utime, anchors } of noted) {
    const anchor = anchors.find(({ name }) => name === "bench");
    const expected = anchor && truth.pixelOf(p_world, utime);
    if (expected) errors.push({ utime, error: Math.hypot(anchor.pixel[0] - expected[0], anchor.pixel[1] - expected[1]) });
  }
  return { errors, images: noted.length };
}

await run(async () => {
  const [first, second] = [1, 2].map((n) => new Truth(`${options.recordings}/phone_${n}`));
  const target = chooseTarget(first, second);
  console.log(`target ${target.distance.toFixed(1)} m away, at ${((target.utime - first.poses[0].utime) / 1e6).toFixed(1)} s, in view of ${target.seen} of page 2's poses at 10 Hz`);
  const server = new Server();
  await server.start();
  const browser = await server.browser();
  server.startNative(3, `${options.recordings}/phone_3`);
  const anna = await joined(browser, server, "Anna", `${options.recordings}/phone_1`);
  const placing = placeAt(anna, target);
  const ben = await joined(browser, server, "Ben", `${options.recordings}/phone_2`);
  check("page 1 places an anchor", await placing);
  const ended = (page) => page.waitForFunction(() => /100 %/.test(document.getElementById("numbers").textContent), undefined, { timeout: 300_000 });
  const shown = ben.waitForFunction(() => pangea.stage.drawn?.anchors.some(({ name, pixel }) =>
    name === "bench" && pixel[0] > 60 && pixel[0] < 580 && pixel[1] > 60 && pixel[1] < 420), undefined, { timeout: 300_000 });
  shown.then(() => ben.screenshot({ path: `${options.out}/phone_anchor_2.png` }), () => {});
  await anna.screenshot({ path: `${options.out}/phone_anchor_1.png` });
  await Promise.all([ended(anna), ended(ben)]);
  for (const [name, page] of [["Anna", anna], ["Ben", ben]]) {
    const { fused, group, map, state } = await page.evaluate(() => pangea.walk.pose);
    console.log(`${name}: ${state}, map ${map}, group ${group}, fused ${fused}, ${await page.evaluate(() => pangea.walk.vio.text)}`);
  }
  const groups = await Promise.all([anna, ben].map((page) => page.evaluate(() => pangea.walk.pose.group)));
  check("both are in one group", groups[0] !== undefined && groups[0] === groups[1], groups.join(", "));
  const { errors, images } = await errorsIn(ben, second, target.p_world);
  const values = errors.map(({ error }) => error);
  const summary = `in ${values.length} of ${images} images: median ${median(values)?.toFixed(1)}, largest ${Math.max(...values).toFixed(1)} px`;
  check(`page 2 shows it within ${kMaxError_px} px of the truth`, values.length > 10 && median(values) <= kMaxError_px, summary);
  await browser.close();
});
