import assert from "node:assert/strict";
import { test } from "node:test";
import { NewestFrame } from "./newest_frame";

function world() {
  const given: number[] = [];
  const dropped: number[] = [];
  const frames = new NewestFrame<{ utime: number }>(({ utime }) => given.push(utime), ({ utime }) => dropped.push(utime));
  return { given, dropped, frames };
}

test("an agent that keeps up gets every image", () => {
  const { given, dropped, frames } = world();
  for (let utime = 1; utime <= 3; ++utime) {
    frames.add({ utime });
    frames.done();
  }
  assert.deepEqual(given, [1, 2, 3]);
  assert.deepEqual(dropped, []);
});

test("a slow agent gets the newest, and what it did not get is freed", () => {
  const { given, dropped, frames } = world();
  for (let utime = 1; utime <= 4; ++utime) frames.add({ utime });
  assert.deepEqual(given, [1]);
  frames.done();
  assert.deepEqual(given, [1, 4]);
  assert.deepEqual(dropped, [2, 3]);
  assert.equal(frames.numDropped, 2);
});

test("nothing is given twice", () => {
  const { given, frames } = world();
  frames.add({ utime: 1 });
  frames.done();
  frames.done();
  assert.deepEqual(given, [1]);
});

test("when it is stopped, the agent gets no more, and all are freed", () => {
  const { given, dropped, frames } = world();
  frames.add({ utime: 1 });
  frames.add({ utime: 2 });
  frames.stop();
  frames.done();
  frames.add({ utime: 3 });
  assert.deepEqual(given, [1]);
  assert.deepEqual(dropped, [2, 3]);
});
