// Helpers for tests of the page: the viewer as a process, a browser, and checks that print what they found.

import { spawn } from "node:child_process";
import { parseArgs } from "node:util";
import { chromium } from "playwright-core";

export const { values: options } = parseArgs({
  options: {
    bin: { type: "string" }, // folder of the programs
    chromium: { type: "string" },
    log: { type: "string" },
    page: { type: "string" }, // folder of the phone's page
    recordings: { type: "string" }, // of phones: phone_1, phone_2, ...
    out: { type: "string" }, // for screenshots
    wasm: { type: "string" }, // folder of pangea-agent.mjs
  },
});

const children = [];

export function start(program, ...args) {
  const child = spawn(program, args, { stdio: ["ignore", "pipe", "inherit"] });
  children.push(child);
  return child;
}

// Starts pangea-viewer on a free port; resolves to the page's address.
export function startViewer(...args) {
  const viewer = start(`${options.bin}/pangea-viewer`, "--port", "0", ...args);
  return new Promise((resolve, reject) => {
    let said = "";
    viewer.stdout.on("data", (text) => {
      said += text;
      const url = said.match(/http:\S+/);
      if (url) resolve({ url: url[0], viewer });
    });
    viewer.on("exit", (code) => reject(new Error(`pangea-viewer ended with ${code}`)));
  });
}

export const launch = (more = []) =>
  chromium.launch({
    executablePath: options.chromium,
    // Software rendering, because CI machines have no graphics card; only of what the pages draw in WebGL, for composing the
    // rest this way takes twice as long.
    args: ["--no-sandbox", "--disable-gpu-compositing", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", ...more],
  });

const consoleErrors = [];
function noteError(text) {
  consoleErrors.push(text);
  console.log(`       the browser's console: ${text}`); // between the checks, where it happened
}

// `prepare` is called with the page before it is loaded.
export async function openPage(browser, url, context = {}, prepare = async () => {}) {
  const page = await (
    await browser.newContext({ viewport: { width: 1280, height: 800 }, ...context })
  ).newPage();
  page.on("console", (message) => {
    if (["error", "warning"].includes(message.type())) noteError(message.text());
  });
  page.on("pageerror", (error) => noteError(String(error)));
  await prepare(page);
  await page.goto(url);
  return page;
}

// The page's errors, without Chromium's own messages: about software rendering, and about camera images that it had ready for the page
// when the camera ended (camera.test.ts checks that the page closes each image that it receives).
const ownErrors = () =>
  consoleErrors.filter((text) => !/GPU stall|software WebGL|swiftshader|VideoFrame was garbage collected/i.test(text));

let failures = 0;

export function check(what, good, saw = "") {
  if (!good) ++failures;
  console.log(`${good ? "ok    " : "FAILED"} ${what}${saw === "" ? "" : `: ${saw}`}`);
}

// Waits until `condition` is true in the page; `what` describes it.
export async function becomes(page, what, condition, argument, timeout = 60_000) {
  try {
    await page.waitForFunction(condition, argument, { timeout });
    check(what, true);
  } catch (error) {
    check(what, false, String(error).split("\n")[0]);
  }
}

// `expected`: errors in the console that the test itself causes.
export async function run(test, expected = /^$/) {
  try {
    await test();
    const errors = ownErrors().filter((text) => !expected.test(text));
    check("no error in the console", errors.length === 0, errors.join(" | "));
  } catch (error) {
    check("the test ran to its end", false, error.stack);
  } finally {
    for (const child of children) child.kill();
  }
  process.exit(failures === 0 ? 0 : 1);
}
