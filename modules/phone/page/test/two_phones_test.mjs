// Two pages play recordings of rendered phones, by invite, over TLS, with a real server and gateway, beside a native agent. They must
// fuse. Page 1 places anchors on points of the scene; page 2 must show them at the right places in its own images, and each page must
// show the other. Page 2 first has to calibrate its camera; page 1 walks until page 2 is done, so that it learns who joined its map.

import { cpSync, mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { check, options, run } from "../../../viewer/page/test/harness.mjs";
import { checkFused, checkShown, chooseTargets, photograph, placeAll } from "./anchor_truth.mjs";
import { atEnd, checkEachOther, joined, recording } from "./pair.mjs";
import { Server } from "./server.mjs";
import { Truth } from "./truth.mjs";

// A copy of the recording without its camera's calibration.
function uncalibrated(folder) {
  const copy = `${mkdtempSync(`${tmpdir()}/pangea_uncalibrated_`)}/walk`;
  cpSync(folder, copy, { recursive: true });
  rmSync(`${copy}/mav0/cam0/sensor.yaml`);
  return copy;
}

await run(async () => {
  const [first, second] = [3, 2].map((n) => new Truth(recording(n)));
  const targets = chooseTargets(first, second);
  const server = new Server();
  await server.start();
  const browser = await server.browser();
  server.startNative(3, recording(1));
  const anna = await joined(browser, server, "Anna", recording(3));
  const placing = placeAll(anna, first, targets);
  const ben = await joined(browser, server, "Ben", uncalibrated(recording(2)));
  console.log(`       calibrated: ${await ben.evaluate(() => pangea.walk.camera.intrinsics.map((value) => value.toFixed(1)).join(" "))}`);
  void photograph(anna, `${options.out}/phone_anchor_1.png`);
  void photograph(ben, `${options.out}/phone_anchor_2.png`);
  await Promise.all([placing, atEnd(anna), atEnd(ben)]);
  await checkFused([anna, ben]);
  await checkShown(ben, second, targets);
  await checkEachOther({ page: anna, truth: first }, { page: ben, truth: second });
  await browser.close();
});
