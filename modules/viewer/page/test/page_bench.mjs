// How fast the page draws and how much it is sent: on a synthetic log (pangea-viewer-bench-log) given as --log.
// Prints one line of figures; bench/README.md says what they are of.

import { launch, openPage, options, run, startViewer } from "./harness.mjs";

await run(async () => {
  const browser = await launch();
  const { url } = await startViewer("--log", options.log);
  const page = await openPage(browser, url);
  await page.waitForFunction(() => pangea.model.start !== undefined);
  const state = () =>
    page.evaluate(() => ({
      agents: pangea.model.agents.size,
      keyframes: pangea.model.numKeyframes,
      points: pangea.model.numPoints,
      received: pangea.received(),
      now_s: pangea.model.now_s,
    }));
  const rate = async (seconds) => {
    const before = await state();
    const began = performance.now();
    const fps = await page.evaluate((s) => pangea.framesPerSecond(s), seconds);
    const after = await state();
    const took = (performance.now() - began) / 1000;
    return { fps, kB_per_s: (after.received - before.received) / 1000 / took, after };
  };
  const say = (what, { fps, kB_per_s, after }) =>
    console.log(
      `${what}: ${after.agents} agents, ${after.keyframes} keyframes, ${after.points} points: ` +
        `${fps.toFixed(1)} frames/s, ${kB_per_s.toFixed(1)} kB/s`,
    );
  say("playing, before fusion", await rate(8));
  // The last ten seconds, with a solve twice a second that moves everything.
  const end = await page.evaluate(() => pangea.model.start.end_s);
  const slider = page.locator("#slider");
  await slider.fill(String(Math.floor(end - 12)));
  await page.waitForFunction((t) => pangea.model.now_s >= t, end - 11.5);
  say("playing, all fused and solved twice a second", await rate(8));
  await page.waitForFunction((t) => pangea.model.now_s >= t - 0.1, end, { timeout: 60000 });
  await page.waitForTimeout(3000);
  say("at rest, every frame drawn", await rate(8));
  const fresh = await openPage(browser, url);
  const began = performance.now();
  const wanted = (await state()).keyframes;
  await fresh.waitForFunction((n) => pangea.model.numKeyframes === n, wanted);
  const { received } = await fresh.evaluate(() => ({ received: pangea.received() }));
  console.log(
    `a second browser has everything after ${((performance.now() - began) / 1000).toFixed(1)} s and ${(received / 1e6).toFixed(2)} MB`,
  );
  await browser.close();
});
