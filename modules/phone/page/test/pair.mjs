// Helpers for two pages of one server, of which at least one plays a recording.

import { realpathSync } from "node:fs";
import { check, openPage, options } from "../../../viewer/page/test/harness.mjs";
import { noteDrawn } from "./anchor_truth.mjs";
import { checkOther, noteOthers } from "./others_truth.mjs";

// The real path, because Chromium does not open files whose path has "..".
export const recording = (n) => realpathSync(`${options.recordings}/phone_${n}`);

export function openInvited(browser, server, name, prepare = undefined) {
  return openPage(browser, server.invite(name), { viewport: { width: 960, height: 720 } }, prepare);
}

// A page that plays the recording in a folder.
export async function joined(browser, server, name, folder) {
  const page = await openInvited(browser, server, name);
  await page.locator("#name").fill(name);
  await page.locator("#folder").setInputFiles(folder);
  await page.waitForFunction(() => pangea.walk?.link === "open", undefined, { timeout: 300_000 });
  check(`${name} has joined, and the link is open`, true);
  await noteDrawn(page);
  await noteOthers(page);
  return page;
}

export const atEnd = (page) => page.waitForFunction(() => /100 %/.test(document.getElementById("numbers").textContent), undefined, { timeout: 600_000 });

// Checks that each of two pages shows the other. `sides`: two pages with their truth (others_truth.mjs).
export async function checkEachOther(...sides) {
  for (const side of sides) side.agent = await side.page.evaluate(() => pangea.walk.membership.agent);
  await checkOther(sides[0], sides[1]);
  await checkOther(sides[1], sides[0]);
}
