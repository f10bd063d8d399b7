import assert from "node:assert/strict";
import { test } from "node:test";
import { openingTime } from "./opening_time";

test("each run opens its map after those before it, also when the clock was set back", () => {
  const texts = new Map<string, string>();
  const localStorage = { getItem: (key: string) => texts.get(key) ?? null, setItem: (key: string, text: string) => texts.set(key, text) };
  Object.defineProperty(globalThis, "localStorage", { value: localStorage, configurable: true });
  const now_us = 1_700_000_000_000_000;
  assert.equal(openingTime(now_us), now_us);
  assert.equal(openingTime(now_us + 60e6), now_us + 60e6);
  assert.equal(openingTime(now_us - 3600e6), now_us + 61e6);
  assert.equal(openingTime(now_us - 3600e6), now_us + 62e6);
  assert.equal(openingTime(now_us + 3600e6), now_us + 3600e6);
  for (const key of texts.keys()) texts.set(key, "damaged");
  assert.equal(openingTime(now_us), now_us);
});

test("a browser without storage has only the clock", () => {
  Object.defineProperty(globalThis, "localStorage", { get: () => { throw new Error("denied"); }, configurable: true });
  assert.equal(openingTime(17), 17);
});
