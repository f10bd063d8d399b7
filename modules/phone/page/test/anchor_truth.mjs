// An anchor that page 1 places on something of a rendered scene, and how far from it page 2 draws it.

import { check } from "../../../viewer/page/test/harness.mjs";

const kPlace_s = [8, 16]; // of recording 1, when the anchor is placed
const kDistance_m = [1.2, 5];
const kMaxError_px = 10;

// What page 1 will tap: a point of the scene that recording 2 has longest in view afterwards.
export function chooseTarget(first, second) {
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
export const noteDrawn = (page) => page.evaluate(() => {
  window.noted = [];
  const look = () => {
    const { drawn } = pangea.stage;
    if (drawn && drawn.utime !== noted.at(-1)?.utime) noted.push(structuredClone(drawn));
    requestAnimationFrame(look);
  };
  look();
});

// Taps, so to say, on the target in the first image that is shown at its time or after it. `offset_us`: from the page's stamps to
// the recording's.
export function placeAt(page, truth, { utime, p_world }, offset_us = 0) {
  const kStep_us = 5000;
  const pixels = Array.from({ length: 200 }, (_, i) => truth.pixelOf(p_world, utime + i * kStep_us));
  return page.evaluate(([from_us, step_us, table]) => new Promise((done) => {
    const look = () => {
      const shown = pangea.stage.drawn?.utime ?? -Infinity;
      if (shown < from_us) return requestAnimationFrame(look);
      const pixel = table[Math.round((shown - from_us) / step_us)];
      if (pixel) pangea.walk.placeAnchor("bench", shown, pixel);
      done(Boolean(pixel));
    };
    look();
  }), [utime - offset_us, kStep_us, pixels]);
}

const median = (values) => [...values].sort((a, b) => a - b)[Math.floor(values.length / 2)];

// The anchor in page 2's images against where the target is in them.
export async function checkShown(page, truth, { p_world }, offset_us = 0) {
  const noted = await page.evaluate(() => noted);
  const errors = noted.flatMap(({ utime, anchors }) => {
    const anchor = anchors.find(({ name }) => name === "bench");
    const expected = anchor && truth.pixelOf(p_world, utime + offset_us);
    return expected ? [Math.hypot(anchor.pixel[0] - expected[0], anchor.pixel[1] - expected[1])] : [];
  });
  const summary = `in ${errors.length} of ${noted.length} images: median ${median(errors)?.toFixed(1)}, largest ${Math.max(...errors).toFixed(1)} px`;
  check(`page 2 shows the anchor within ${kMaxError_px} px of the truth`, errors.length > 10 && median(errors) <= kMaxError_px, summary);
}

// In one group, as they are told. The one with the oldest map is told nothing unless it walks on.
export async function checkFused(pages) {
  const poses = await Promise.all(pages.map((page) => page.evaluate(() => pangea.walk.pose)));
  poses.forEach(({ state, map, group, fused }) => console.log(`       ${state}, map ${map}, group ${group}, fused ${fused}`));
  check("all are in one group", poses.every(({ map, group }) => (group ?? map) === (poses[0].group ?? poses[0].map)));
}

// Waits, not for ever, until the page has the anchor well in its image, and photographs it.
export async function photograph(page, file) {
  const isSeen = () => pangea.stage.drawn?.anchors.some(({ name, pixel: [u, v] }) =>
    name === "bench" && u > 80 && u < 560 && v > 80 && v < 400);
  await page.waitForFunction(isSeen, undefined, { timeout: 300_000 }).then(() => page.screenshot({ path: file }), () => {});
}
