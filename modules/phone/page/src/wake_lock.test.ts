import assert from "node:assert/strict";
import { test } from "node:test";
import { WakeLock } from "./wake_lock";

const settled = () => new Promise((done) => setTimeout(done, 0));

// A browser whose screen stays on while `held` is not 0.
function installBrowser() {
  const screen = { held: 0 };
  const request = async () => {
    ++screen.held;
    return { release: async () => void --screen.held };
  };
  Object.defineProperty(globalThis, "navigator", { value: { wakeLock: { request } }, configurable: true });
  return screen;
}

test("the screen stays on until the end, also when it was kept twice", async () => {
  const screen = installBrowser();
  const lock = new WakeLock();
  lock.keep();
  await settled();
  lock.keep();
  await settled();
  assert.equal(screen.held, 1);
  lock.release();
  lock.release();
  await settled();
  assert.equal(screen.held, 0);
});

test("an end that comes before the browser's answer counts", async () => {
  const screen = installBrowser();
  const lock = new WakeLock();
  lock.keep();
  lock.release();
  await settled();
  assert.equal(screen.held, 0);
});

test("a browser without it is not asked", () => {
  Object.defineProperty(globalThis, "navigator", { value: {}, configurable: true });
  const lock = new WakeLock();
  lock.keep();
  lock.release();
});
