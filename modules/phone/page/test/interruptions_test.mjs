// Interruptions of phones, with a real server and gateway: the network is gone for a minute while Anna walks, and meanwhile Ben places an
// anchor, and his tab is killed. No keyframe and no anchor may be lost; Ben's old map must stay, and his new one must fuse.

import { execFileSync } from "node:child_process";
import { check, openPage, options, run } from "../../../viewer/page/test/harness.mjs";
import { Network } from "./network.mjs";
import { recording } from "./pair.mjs";
import { Server } from "./server.mjs";

const kGone_s = 60;
const kLeft = 8; // keyframes that Ben leaves behind
const kAllSent_ms = 600_000; // after the network is back, and the recordings played

const seconds = (time_s) => new Promise((done) => setTimeout(done, 1000 * time_s));

async function joined(browser, server, network, name, n) {
  const page = await openPage(browser, server.invite(name).replace(`:${server.port}/`, `:${network.port}/`));
  await page.locator("#name").fill(name);
  await play(page, n);
  return page;
}

async function play(page, n) {
  await page.locator("#folder").setInputFiles(recording(n));
  await page.waitForFunction(() => pangea.walk?.pose?.state === "tracking", undefined, { timeout: 120_000 });
}

const mapOf = (page) => page.evaluate(() => pangea.walk.pose.map);
const unsent = (page) => page.evaluate(() => pangea.walk.numUnsent);

const allSent = (page) => page.waitForFunction(
  () => /100 %/.test(document.getElementById("numbers").textContent) && pangea.walk.numUnsent === 0, undefined, { timeout: kAllSent_ms });

// The keyframes of a map in the server's journal, as ids of the page's storage, and whether they are the first ones of the map without
// gaps.
function keyframesOf(server, map) {
  const [agent, opened_utime] = map.split("/").map(Number);
  const list = execFileSync(`${options.bin}/pangea-log`,
    ["list", "--json", "--channels", `KEYFRAME_${agent}`, `${server.site}/journal.lcm`], { encoding: "utf8", maxBuffer: 1e9 });
  const ids = list.split("\n").filter(Boolean).map((line) => JSON.parse(line).message.keyframe.id).filter((id) => id.map.opened_utime === opened_utime);
  const seqs = new Set(ids.map(({ seq }) => seq));
  return { ids: [...seqs].map((seq) => `${map}#${seq}`), isWhole: [...seqs].every((seq) => seq < seqs.size) };
}

// The names of the anchors in the server's journal that were placed in a map.
function anchorsOf(server, map) {
  const list = execFileSync(`${options.bin}/pangea-log`, ["list", "--json", "--channels", "ANCHOR_EDIT", `${server.site}/journal.lcm`], { encoding: "utf8" });
  const edits = list.split("\n").filter(Boolean).map((line) => JSON.parse(line).message);
  return edits.filter((edit) => `${edit.map.agent_id}/${edit.map.opened_utime}` === map).map(({ name }) => name);
}

// The ids of keyframes and anchors in a page's storage, which the server has not acknowledged.
const spooled = (page, agent) => page.evaluate((name) => new Promise((done, failed) => {
  const open = indexedDB.open(name);
  open.onerror = () => failed(open.error);
  open.onsuccess = () => {
    const keys = open.result.transaction("keyframes").objectStore("keyframes").getAllKeys();
    keys.onsuccess = () => (open.result.close(), done(keys.result));
  };
}), `pangea.spool.${agent}`);

async function kill(page) {
  const devtools = await page.context().newCDPSession(page);
  const crashed = new Promise((done) => page.on("crash", done));
  devtools.send("Page.crash").catch(() => {});
  await crashed;
}

await run(async () => {
  const server = new Server();
  await server.start();
  const network = await Network.before(server.port);
  const browser = await server.browser();
  const anna = await joined(browser, server, network, "Anna", 3);
  const ben = await joined(browser, server, network, "Ben", 1);

  network.cut();
  const cut = Date.now();
  const oldMap = await mapOf(ben);
  await ben.evaluate(() => pangea.walk.placeAnchor("kettle", pangea.walk.pose.utime, [320, 240]));
  let left = [];
  let anchors = [];
  while ((left.length < kLeft || anchors.length === 0) && Date.now() - cut < 1000 * kGone_s) {
    await seconds(1);
    const ids = await spooled(ben, Number(oldMap.split("/")[0]));
    left = ids.filter((id) => id.includes("#"));
    anchors = ids.filter((id) => id.startsWith("anchor"));
  }
  check("Ben's keyframes wait in his browser", left.length >= kLeft, left.length);
  check("with his anchor", anchors.length === 1, anchors.length);
  await kill(ben);
  await seconds(kGone_s - (Date.now() - cut) / 1000);
  const hint = await anna.evaluate(() => document.getElementById("hint").textContent);
  check("Anna reads that there is no connection", /^No connection/.test(hint), `${hint}; ${await unsent(anna)} unsent`);
  network.mend();
  const again = await ben.context().newPage();
  await again.goto(`https://localhost:${network.port}/`);
  await play(again, 2);
  await Promise.all([anna, again].map(allSent));
  const ofAnna = keyframesOf(server, await mapOf(anna));
  check("the server has all of Anna's map", ofAnna.isWhole && ofAnna.ids.length > 20, `${ofAnna.ids.length} keyframes`);
  const ofOldMap = keyframesOf(server, oldMap);
  check("and of Ben's old one, also what waited", ofOldMap.isWhole && left.every((id) => ofOldMap.ids.includes(id)), `${ofOldMap.ids.length} keyframes`);
  check("and the anchor in it", anchorsOf(server, oldMap).includes("kettle"), anchorsOf(server, oldMap));
  const { map, fused } = await again.evaluate(() => pangea.walk.pose);
  check("Ben's new map is another one, and fused", fused && map !== oldMap);
  await browser.close();
}, /Failed to load resource: net::ERR_TIMED_OUT/);
