// What the tests of the page share: its server with those parts of the gateway that it uses, and an emulated phone.

import { createServer } from "node:http";
import { readFile } from "node:fs/promises";
import { extname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { WebSocketServer } from "ws";
import { becomes, check, options } from "../../../viewer/page/test/harness.mjs";

const kTypes = { ".html": "text/html", ".js": "text/javascript", ".mjs": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml" };
export const kFake = fileURLToPath(new URL("fake_agent.mjs", import.meta.url));
export const kRevoked = 9; // an agent whose key the server does not know
export const kCameras = ["--use-fake-device-for-media-stream", "--use-fake-ui-for-media-stream"];
const kAgents = { agents: [{ agent: 2, name: "Anna", connected: true }, { agent: 3, name: "Ben", connected: true }] };

// Refuses the first upload and keeps the second one.
export const uploads = [];
function takeUploads(socket) {
  const messages = [];
  if (uploads.push(messages) === 1) return socket.close(4413, "the server has no room for more recordings");
  socket.on("message", (message) => {
    messages.push(message);
    const [, size, ...parts] = messages;
    if (!size) return;
    const taken = parts.reduce((sum, { length }) => sum + length, 0);
    if (BigInt(taken) === size.readBigUInt64LE()) return socket.close(4200, "walk.zip");
    const said = Buffer.alloc(8);
    said.writeBigUInt64LE(BigInt(taken));
    socket.send(said);
  });
}

// Serves the page, and those parts of the gateway that it uses.
export async function serve() {
  const server = createServer(async ({ url }, answer) => {
    const path = new URL(url, "http://x").pathname;
    if (path === "/v1/info") return answer.end(JSON.stringify(kAgents));
    if (path === "/v1/join") {
      answer.statusCode = 403;
      return answer.end(JSON.stringify({ error: "This code is not known, or was used." }));
    }
    const file = path === "/pangea_agent.mjs" ? kFake : join(options.page, path === "/" ? "index.html" : path);
    answer.setHeader("Content-Type", kTypes[extname(file)] ?? "application/octet-stream");
    answer.end(await readFile(file).catch(() => ((answer.statusCode = 404), "")));
  });
  new WebSocketServer({ server }).on("connection", (socket, { url }) => {
    socket.send(Buffer.alloc(32));
    if (url.startsWith("/recording")) takeUploads(socket);
    if (url.endsWith(`=${kRevoked}`)) socket.close(4401);
  });
  await new Promise((done) => server.listen(0, "127.0.0.1", done));
  return `http://localhost:${server.address().port}/`;
}

export const screenshot = (page, name) => page.screenshot({ path: `${options.out}/phone_${name}.png` });
export const kPhone = { viewport: { width: 360, height: 720 }, permissions: ["camera", "accelerometer", "gyroscope"] };
export const told = (page) => page.evaluate(() => JSON.parse(pangea.walk.vio.text));

// The motion of a phone that is held upright and rotates about its x axis.
export async function senseMotion(page) {
  const devtools = await page.context().newCDPSession(page);
  const readings = [["accelerometer", 0, 9.8, 0.3], ["linear-acceleration", 0, 0, 0.3], ["gyroscope", 0.5, 0, -0.25]];
  for (const [type] of readings) {
    await devtools.send("Emulation.setSensorOverrideEnabled", { enabled: true, type, metadata: { available: true } });
  }
  for (const [type, x, y, z] of readings) {
    await devtools.send("Emulation.setSensorOverrideReadings", { type, reading: { xyz: { x, y, z } } });
  }
}

// Chromium warns of an image that is in the page's hands when the page is closed.
export async function stopAndClose(page) {
  await page.evaluate(() => document.getElementById("stop").click());
  await page.waitForFunction(() => document.getElementById("welcome").checkVisibility());
  await page.close();
}

// One image that the browser cannot read must not stop the camera.
export async function testBrokenImage(page) {
  await page.evaluate(() => {
    const { createImageBitmap } = window;
    window.createImageBitmap = async () => {
      Object.assign(window, { createImageBitmap, imagesBefore: pangea.walk.numImages });
      throw new Error("this image is broken");
    };
  });
  await becomes(page, "a broken image is left out", () => pangea.walk.numImages > window.imagesBefore + 5);
}

// Keeps the streams of cameras, and counts the requests to keep the screen on; `whileOpening` is called while one is being opened. `lacks`: what the browser does not have.
export function watchCameras({ lacks = [] }) {
  for (const name of lacks) delete window[name];
  const devices = navigator.mediaDevices;
  const open = devices.getUserMedia.bind(devices);
  window.streams = [];
  devices.getUserMedia = async (wanted) => {
    const stream = await open(wanted);
    window.streams.push(stream);
    window.whileOpening?.();
    return stream;
  };
  window.numCameras = () => window.streams.filter(({ active }) => active).length;
  const locks = new Set();
  window.numAwake = () => locks.size;
  const request = async () => {
    const lock = { release: async () => void locks.delete(lock) };
    locks.add(lock);
    return lock;
  };
  Object.defineProperty(navigator, "wakeLock", { value: { request } });
  // A hidden page loses its lock.
  window.hide = (hidden) => {
    if (hidden) locks.clear();
    Object.defineProperty(document, "hidden", { value: hidden, configurable: true });
    document.dispatchEvent(new Event("visibilitychange"));
  };
  window.rotate = () => screen.orientation.dispatchEvent(new Event("change"));
}

// The agent of the walk is a new one, and it is the only one.
export async function hasOneNewAgent(page, what) {
  await becomes(page, what, () => !pangea.walk?.isOld && pangea.walk?.vio?.counters.images > 2);
  check("with one agent and one camera", page.workers().length === 1 && (await page.evaluate(() => numCameras())) === 1,
    `${page.workers().length}, ${await page.evaluate(() => numCameras())}`);
  await page.evaluate(() => (pangea.walk.isOld = true));
}
