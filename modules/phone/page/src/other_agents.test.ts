import assert from "node:assert/strict";
import { test } from "node:test";
import type { Others, Pose7 } from "./agent/phone_agent";
import { OtherAgents } from "./other_agents";

const at = (x: number): Pose7 => [x, 0, 1.5, 0, 0, 0, 1];
const told = (x: number, map = "1/1"): Others => ({ map, others: [{ agent: 2, T_odom_cam: at(x) }] });

test("goes evenly to where it was told last", () => {
  const people = new OtherAgents();
  const x = (now_ms: number) => people.in("1/1", now_ms)[0].T_odom_cam[0];
  people.take(told(1), 1000);
  assert.equal(x(1000), 1);
  people.take(told(2), 1250);
  assert.equal(x(1250), 1);
  assert.equal(x(1375), 1.5);
  people.take(told(3), 1375); // while it still moves
  assert.equal(x(1375), 1.5);
  assert.equal(x(1625), 3);
  assert.equal(x(2000), 3);
});

test("jumps where the map was corrected", () => {
  const people = new OtherAgents();
  people.take(told(1), 1000);
  people.take(told(9), 1200);
  assert.equal(people.in("1/1", 1200)[0].T_odom_cam[0], 9);
});

test("is gone when the server is silent, and in another map", () => {
  const people = new OtherAgents();
  people.take(told(1), 1000);
  assert.equal(people.in("1/1", 2999).length, 1);
  assert.equal(people.in("1/1", 3000).length, 0);
  assert.equal(people.in("1/2", 1100).length, 0);
  people.take({ map: "1/2", others: [{ agent: 3, T_odom_cam: at(0) }] }, 1200);
  assert.deepEqual(people.in("1/2", 1200).map(({ agent }) => agent), [3]);
});
