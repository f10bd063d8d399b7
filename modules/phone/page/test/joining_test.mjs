// Tests the page as page_test.mjs does: joining, uploading, storage that others hold or that is refused, and leaving.

import { readFile } from "node:fs/promises";
import { unzipSync } from "fflate";
import { becomes, check, launch, openPage, run } from "../../../viewer/page/test/harness.mjs";
import {
  hasOneNewAgent, kCameras, kFake, kPhone, kRevoked, screenshot, senseMotion, serve, stopAndClose, testBrokenImage, uploads, watchCameras,
} from "./page_tools.mjs";

// The visitor taps Start twice, and the browser stores nothing and gives images as Safari does. The code of the invite works only once.
async function testJoining(browser, url) {
  const page = await openPage(browser, `${url}#join=ABCD-EFGH`, kPhone, async (page) => {
    await page.addInitScript(watchCameras, { lacks: ["MediaStreamTrackProcessor"] });
    await page.addInitScript(() => Object.defineProperty(window, "localStorage", { get: () => { throw new DOMException("denied", "SecurityError"); } }));
  });
  const answers = [{ json: { agent: 2, key: "ab".repeat(32), site: "hall" } }];
  await page.route("**/v1/join", (route) => route.fulfill(answers.pop() ?? { status: 403, json: { error: "used already" } }));
  const noStorage = "indexedDB.open = () => { throw new Error('no storage'); };\n";
  const body = noStorage + (await readFile(kFake, "utf8"));
  await page.route("**/pangea_agent.mjs", (route) => route.fulfill({ contentType: "text/javascript", body }));
  await senseMotion(page);
  await page.evaluate(() => {
    window.notices = [];
    const notice = document.getElementById("notice");
    new MutationObserver(() => window.notices.push(notice.textContent)).observe(notice, { childList: true });
    document.getElementById("join").requestSubmit();
  });
  check("Start cannot be tapped twice", await page.locator("#start").isDisabled());
  await page.evaluate(() => document.getElementById("join").requestSubmit());
  await becomes(page, "without storage a visitor is told that the key is lost", () => notices.some((text) => /does not keep your key/.test(text)));
  await page.locator("#skip").click();
  await becomes(page, "without storage a member is told so", () => /does not keep what is unsent: .*no storage/.test(document.getElementById("notice").textContent));
  await hasOneNewAgent(page, "and walks, with images as in Safari");
  await testBrokenImage(page);
  check("the code was used once", (await page.evaluate(() => pangea.walk.membership?.agent)) === 2);
  await page.locator("#stop").click();
  check("then one can start again", await page.locator("#start").isEnabled());
  await page.close();
}

// A member can choose to upload the recording. Images come as in Firefox on Android.
async function testUpload(browser, url) {
  const page = await openPage(browser, url, kPhone, (page) => page.addInitScript(watchCameras, { lacks: ["MediaStreamTrackProcessor", "VideoFrame"] }));
  await page.evaluate((key) => localStorage.setItem("pangea.membership", JSON.stringify({ agent: 2, key, site: "hall", name: "Anna" })), "ab".repeat(32));
  await page.reload();
  await senseMotion(page);
  await page.locator("#start").click();
  await page.locator("#skip").click();
  await becomes(page, "a member starts, with images as in Firefox on Android", () => pangea.walk?.vio?.counters.images > 2);
  await page.locator("#record").click();
  await becomes(page, "images are recorded", () => pangea.walk.recorder?.numImages > 5);
  await page.locator("#record").click();
  await page.locator("#save_dialog [value=server]").click();
  await becomes(page, "a refused upload says why, and the page asks anew", () =>
    document.getElementById("save_dialog").open && /not uploaded: the server has no room/.test(document.getElementById("save_text").textContent));
  await screenshot(page, "save");
  await page.locator("#save_dialog [value=server]").click();
  await becomes(page, "the second is kept", () => /keeps it as walk\.zip/.test(document.getElementById("notice").textContent));
  const files = Object.keys(unzipSync(Buffer.concat(uploads[1].slice(2))));
  check("whole", files.filter((name) => name.endsWith(".jpg")).length > 5 && files.some((name) => name.endsWith("imu0/data.csv")), `${files.length} files`);
  await stopAndClose(page);
}

// A member scans the code of the invite again, and a phone gets the agent's id of another site's.
async function testMembers(browser, url) {
  const page = await openPage(browser, `${url}#join=ABCD-EFGH`, kPhone);
  const key = "ab".repeat(32);
  await page.evaluate((key) => localStorage.setItem("pangea.membership", JSON.stringify({ agent: 2, key, site: "hall", name: "Anna" })), key);
  await page.reload();
  await senseMotion(page);
  await page.locator("#start").click();
  await becomes(page, "a member who scans a used code again starts", () => Boolean(pangea.calibration));
  check("and reads so", /^You go on as Anna/.test(await page.locator("#notice").textContent()), await page.locator("#notice").textContent());
  await page.locator("#skip").click();
  await becomes(page, "as the member", () => pangea.walk?.membership?.agent === 2);
  await page.locator("#stop").click();
  check("without the code", (await page.evaluate(() => location.hash)) === "" && !(await page.locator("#code").isVisible()));

  await page.evaluate(() => (location.hash = "join=JKMN-PQRS"));
  await becomes(page, "a link that is followed in the same tab is read", () => document.getElementById("code").value === "JKMN-PQRS");
  const spool = "pangea.spool.2";
  await leaveUnsent(page, spool);
  await page.route("**/v1/join", (route) => route.fulfill({ json: { agent: 2, key, site: "yard" } }));
  await page.locator("#start").click();
  await becomes(page, "whoever joins is calibrated", () => Boolean(pangea.calibration));
  const left = await page.evaluate((name) => new Promise((done) => {
    const open = indexedDB.open(name);
    open.onsuccess = () => {
      const { result } = open;
      if (result.objectStoreNames.length === 0) return result.close(), done(0);
      const count = result.transaction("keyframes").objectStore("keyframes").count();
      count.onsuccess = () => (result.close(), done(count.result));
    };
  }), spool);
  check("and does not send the keyframes of an earlier agent", left === 0, left);
  await stopAndClose(page);
}

// Stores a keyframe that waits for the server.
const leaveUnsent = (page, spool) => page.evaluate((name) => new Promise((done) => {
  const open = indexedDB.open(name, 1);
  open.onupgradeneeded = () => open.result.createObjectStore("keyframes", { keyPath: "id" });
  open.onsuccess = () => {
    const writing = open.result.transaction("keyframes", "readwrite");
    writing.objectStore("keyframes").put({ id: "2/1#0", order: 0, bytes: new Uint8Array(1) });
    writing.oncomplete = () => (open.result.close(), done());
  };
}), spool);

// A member whose key was revoked can enter the code of a new invite, without leaving first.
async function testRevoked(browser, url) {
  const page = await openPage(browser, url, kPhone);
  await page.evaluate(([agent, key]) => localStorage.setItem("pangea.membership", JSON.stringify({ agent, key, site: "hall", name: "Eva" })),
    [kRevoked, "ab".repeat(32)]);
  await page.reload();
  await senseMotion(page);
  await page.locator("#start").click();
  await page.locator("#skip").click();
  await becomes(page, "a member who was revoked is told so", () => /does not know this phone/.test(document.getElementById("hint").textContent));
  await page.locator("#stop").click();
  check("and may enter a new code", await page.locator("#code").isVisible(), await page.locator("#invitation").textContent());
  await page.locator("#code").fill("ABCD-EFGH-JKMN-PQRS");
  await page.locator("#start").click();
  await becomes(page, "which must be valid", () => /This code is not known/.test(document.getElementById("notice").textContent));
  await page.route("**/v1/join", (route) => route.fulfill({ json: { agent: 2, key: "cd".repeat(32), site: "hall" } }));
  await page.locator("#start").click();
  await page.locator("#skip").click();
  await becomes(page, "then it is a new member", () => pangea.walk?.membership?.agent === 2);
  await stopAndClose(page);
}

// Another tab, which the phone has suspended, holds the storage of an earlier agent.
async function testOtherTab(browser, url) {
  const tab = await openPage(browser, url, kPhone);
  await tab.evaluate(() => new Promise((done) => {
    const open = indexedDB.open("pangea.spool.2", 1);
    open.onsuccess = () => done(void (window.held = open.result));
  }));
  const page = await tab.context().newPage();
  await page.goto(`${url}#join=JKMN-PQRS`);
  await page.route("**/v1/join", (route) => route.fulfill({ json: { agent: 2, key: "ab".repeat(32), site: "hall" } }));
  await senseMotion(page);
  await page.locator("#start").click();
  await becomes(page, "whoever joins keeps the key, before another tab lets go of the storage", () =>
    localStorage.getItem("pangea.membership") !== null && !pangea.calibration);
  await page.locator("#skip").click();
  await becomes(page, "and is told that the storage is held", () =>
    /does not keep what is unsent: .*another tab/.test(document.getElementById("notice").textContent));
  await becomes(page, "and walks", () => pangea.walk?.vio?.counters.images > 2);
  await tab.close();
  await stopAndClose(page);
}

async function testLeaving(browser, url) {
  const page = await openPage(browser, url, kPhone);
  await page.evaluate((key) => localStorage.setItem("pangea.membership", JSON.stringify({ agent: 2, key, site: "hall", name: "Anna" })), "ab".repeat(32));
  await leaveUnsent(page, "pangea.spool.2");
  await page.reload();
  const tab = await page.context().newPage();
  await tab.goto(url);
  check("a second tab knows the member", (await tab.locator("#invitation").textContent()).startsWith("You are Anna"));
  await page.bringToFront();
  const isMember = () => page.evaluate(() => localStorage.getItem("pangea.membership") !== null);
  await page.locator("#forget").click();
  await becomes(page, "whoever leaves reads what is lost", () =>
    document.getElementById("leave_dialog").open && /key: .* 1 unsent keyframes/.test(document.getElementById("leave_text").textContent));
  await screenshot(page, "leave");
  await page.locator("#leave_dialog [value=cancel]").click();
  check("and may stay", (await isMember()) && (await page.locator("#invitation").textContent()).startsWith("You are Anna"));
  await page.locator("#forget").click();
  await page.locator("#leave_dialog [value=leave]").click();
  await becomes(page, "or leave", () => document.getElementById("code").checkVisibility());
  check("without the key", !(await isMember()));
  await becomes(tab, "and the second tab has it no longer", () => document.getElementById("code").checkVisibility());
  await page.close();
}

async function testRefusals(browser, url) {
  const page = await openPage(browser, `${url}#join=ABCD-EFGH`);
  check("the code of the link is there", (await page.locator("#code").inputValue()) === "ABCD-EFGH");
  await page.locator("#zip").setInputFiles({ name: "a.zip", mimeType: "application/zip", buffer: Buffer.from("no zip") });
  await becomes(page, "what is no zip is refused with words", () => /zip cannot be read/.test(document.getElementById("notice").textContent));
  check("and can be chosen again", (await page.locator("#zip").inputValue()) === "");
  await page.close();
}

await run(async () => {
  const url = await serve();
  const browser = await launch(kCameras);
  await testJoining(browser, url);
  await testUpload(browser, url);
  await testMembers(browser, url);
  await testRevoked(browser, url);
  await testOtherTab(browser, url);
  await testLeaving(browser, url);
  await testRefusals(browser, url);
  await browser.close();
}, /status of 403/);
