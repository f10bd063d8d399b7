// Places anchors on page 1 at points of a rendered scene, and checks how far from these points page 2 draws them.

import { check } from "../../../viewer/page/test/harness.mjs";

const kPlace_s = [8, 16]; // of recording 1, when anchors are placed
const kDistance_m = [1.2, 5];
const kTargets = 5;
const kApart_m = 1;
const kMaxError_px = 10;

// Chooses the points that page 1 will tap: points of the scene that recording 2 later sees for the longest time, and that are not
// near each other.
export function chooseTargets(first, second) {
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
  const candidates = [];
  for (const [utime, points] of tracks) {
    const at_s = (utime - began) / 1e6;
    if (at_s < kPlace_s[0] || at_s > kPlace_s[1] || Math.round(at_s * 20) % 10 !== 0) continue;
    for (const { id, pixel } of points) {
      if (observations.get(id).length < 20 || pixel[0] < 100 || pixel[0] > 540 || pixel[1] < 80 || pixel[1] > 400) continue;
      const p_world = first.triangulate(observations.get(id));
      const distance = p_world.distanceTo(first.rayOf(pixel, utime).from);
      if (distance < kDistance_m[0] || distance > kDistance_m[1]) continue;
      candidates.push({ utime, p_world, distance, seen: later.filter((time) => second.pixelOf(p_world, time)).length });
    }
  }
  const targets = [];
  for (const candidate of candidates.sort((a, b) => b.seen - a.seen)) {
    const isApart = targets.every(({ p_world }) => p_world.distanceTo(candidate.p_world) > kApart_m);
    if (isApart && targets.length < kTargets) targets.push({ ...candidate, name: `bench ${targets.length}` });
  }
  return targets;
}

// Records for every image that the page shows where it has drawn anchors, and whether it is in a group.
export const noteDrawn = (page) => page.evaluate(() => {
  window.noted = [];
  const look = () => {
    const { drawn } = pangea.stage;
    if (drawn && drawn.utime !== noted.at(-1)?.utime) noted.push({ ...structuredClone(drawn), fused: pangea.walk?.pose?.fused });
    requestAnimationFrame(look);
  };
  look();
});

// Places an anchor on each target, in the first image that is shown at or after its time. `offset_us`: from the page's time stamps to
// the recording's.
export async function placeAll(page, truth, targets, offset_us = 0) {
  const placed = await Promise.all(targets.map((target) => placeAt(page, truth, target, offset_us)));
  check("page 1 places anchors", placed.every(Boolean), targets.map(({ distance }) => `${distance.toFixed(1)} m`).join(", "));
}

function placeAt(page, truth, { name, utime, p_world }, offset_us) {
  const kStep_us = 5000;
  const pixels = Array.from({ length: 200 }, (_, i) => truth.pixelOf(p_world, utime + i * kStep_us));
  return page.evaluate(([name, from_us, step_us, table]) => new Promise((done) => {
    const look = () => {
      const shown = pangea.stage.drawn?.utime ?? -Infinity;
      if (shown < from_us) return requestAnimationFrame(look);
      const pixel = table[Math.round((shown - from_us) / step_us)];
      if (pixel) pangea.walk.placeAnchor(name, shown, pixel);
      done(Boolean(pixel));
    };
    look();
  }), [name, utime - offset_us, kStep_us, pixels]);
}

const median = (values) => [...values].sort((a, b) => a - b)[Math.floor(values.length / 2)];

// Compares the anchors in page 2's images with the true pixels of the targets.
export async function checkShown(page, truth, targets, offset_us = 0) {
  const noted = await page.evaluate(() => noted);
  const told = noted.findIndex(({ fused }) => fused);
  console.log(`       it is told of the group from image ${told} of ${noted.length} on`);
  const medians = [];
  for (const { name, p_world } of targets) {
    const errors = noted.flatMap(({ utime, anchors }) => {
      const anchor = anchors.find((drawn) => drawn.name === name);
      const expected = anchor && truth.pixelOf(p_world, utime + offset_us);
      return expected ? [Math.hypot(anchor.pixel[0] - expected[0], anchor.pixel[1] - expected[1])] : [];
    });
    console.log(`       ${name}, in ${errors.length} images: median ${median(errors)?.toFixed(1)}, largest ${Math.max(0, ...errors).toFixed(1)} px`);
    if (errors.length > 10) medians.push(median(errors));
  }
  check(`page 2 shows most anchors, half of them within ${kMaxError_px} px of the truth`,
    medians.length > targets.length / 2 && median(medians) <= kMaxError_px, `${median(medians)?.toFixed(1)} px`);
}

// Checks that the pages are in one group. The one with the oldest map learns it only while it walks on.
export async function checkFused(pages) {
  const poses = await Promise.all(pages.map((page) => page.evaluate(() => pangea.walk.pose)));
  poses.forEach(({ state, map, group, fused }) => console.log(`       ${state}, map ${map}, group ${group}, fused ${fused}`));
  check("all are in one group", poses.every(({ map, group }) => (group ?? map) === (poses[0].group ?? poses[0].map)));
}

// Waits with a time-out until the page has an anchor well inside its image, and takes a screenshot.
export async function photograph(page, file) {
  const isSeen = () => pangea.stage.drawn?.anchors.some(({ name, pixel: [u, v] }) =>
    name.startsWith("bench") && u > 80 && u < 560 && v > 80 && v < 400);
  await page.waitForFunction(isSeen, undefined, { timeout: 300_000 }).then(() => page.screenshot({ path: file }), () => {});
}
