// As two_phones_test.mjs, but the recordings are the camera and the motion of two emulated phones, one after the other. So everything
// is tested except the phone itself.

import { readFileSync } from "node:fs";
import { check, openPage, options, run } from "../../../viewer/page/test/harness.mjs";
import { checkFused, checkShown, chooseTargets, noteDrawn, photograph, placeAll } from "./anchor_truth.mjs";
import { cameraFile, EmulatedPhone } from "./emulated_phone.mjs";
import { recording } from "./pair.mjs";
import { Server } from "./server.mjs";
import { Truth } from "./truth.mjs";

// Joins with a camera that shows the recording, and with the recording's calibration.
async function started(server, name, n) {
  const browser = await server.browser([
    "--use-fake-device-for-media-stream", "--use-fake-ui-for-media-stream", `--use-file-for-fake-video-capture=${cameraFile(recording(n))}`,
  ]);
  const page = await openPage(browser, server.invite(name), { viewport: { width: 960, height: 720 }, permissions: ["camera", "accelerometer", "gyroscope"] });
  await page.evaluate(async (yaml) => {
    const stream = await navigator.mediaDevices.getUserMedia({ video: true });
    const [track] = stream.getTracks();
    localStorage.setItem(`pangea.calibration.${track.label}.640x480.${screen.orientation.angle}`, yaml);
    track.stop();
  }, readFileSync(`${recording(n)}/mav0/cam0/sensor.yaml`, "utf8"));
  const phone = await EmulatedPhone.on(page, recording(n));
  await page.locator("#name").fill(name);
  await page.locator("#start").click();
  const playing = phone.play(page);
  await phone.begun;
  await noteDrawn(page);
  return { browser, page, phone, playing };
}

// Prints the images per second that the agent got.
async function rates(page) {
  const noted = await page.evaluate(() => noted.map(({ utime }) => utime));
  console.log(`       ${((noted.length - 1) / ((noted.at(-1) - noted[0]) / 1e6)).toFixed(1)} images a second`);
}

await run(async () => {
  const [first, second] = [1, 2].map((n) => new Truth(recording(n)));
  const targets = chooseTargets(first, second);
  const server = new Server();
  await server.start();
  const anna = await started(server, "Anna", 1);
  void photograph(anna.page, `${options.out}/phone_emulated_1.png`);
  await placeAll(anna.page, first, targets, anna.phone.offset_us);
  await anna.playing;
  await rates(anna.page);
  // Her camera would start again from the beginning.
  await anna.page.locator("#stop").click();
  const ben = await started(server, "Ben", 2);
  void photograph(ben.page, `${options.out}/phone_emulated_2.png`);
  await ben.playing;
  await rates(ben.page);
  await checkFused([anna.page, ben.page]);
  await checkShown(ben.page, second, targets, ben.phone.offset_us);
  await Promise.all([anna, ben].map(({ browser }) => browser.close()));
});
