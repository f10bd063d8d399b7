// Two pages that play rendered phones, by invite, over TLS, at a real server with its gateway, beside an agent that is a program:
// they fuse; page 1 places anchors on things of the scene; page 2 shows them where those are in its own images, and each page shows
// the other. Page 2 has to calibrate its camera first; page 1 walks until page 2 is done, so that it is told who joined its map.

import { cpSync, mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { check, options, run } from "../../../viewer/page/test/harness.mjs";
import { checkFused, checkShown, chooseTargets, photograph, placeAll } from "./anchor_truth.mjs";
import { atEnd, checkEachOther, joined, recording } from "./pair.mjs";
import { Server } from "./server.mjs";
import { Truth } from "./truth.mjs";

// The same without calibration of its camera.
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
