import assert from "node:assert/strict";
import { test } from "node:test";
import { ArrivalClock } from "./clock";

const kEpoch = 1_700_000_000_000_000;

// A camera at 20 Hz whose time stamps begin at 0; each image arrives 30 to 60 ms later.
function arrivals(count: number, drift = 0) {
  return Array.from({ length: count }, (_, i) => {
    const stamp = i * 50_000;
    const delay = 30_000 + ((i * 7919) % 30_000);
    return { stamp, arrival: Math.round(kEpoch + stamp * (1 + drift) + delay) };
  });
}

test("jitter of the arrival does not reach the stamps", () => {
  const clock = new ArrivalClock();
  const mapped = arrivals(200).map(({ stamp, arrival }) => clock.map(stamp, arrival)!);
  for (let i = 101; i < 200; ++i) assert.equal(mapped[i] - mapped[i - 1], 50_000);
  const delay = mapped[199] - (kEpoch + 199 * 50_000);
  assert.ok(delay >= 30_000 && delay < 32_000, `${delay} us`);
});

test("a clock that runs 100 ppm fast is followed for ten minutes", () => {
  const clock = new ArrivalClock();
  let last = 0;
  let arrived = 0;
  for (const { stamp, arrival } of arrivals(12_000, 1e-4)) {
    last = clock.map(stamp, arrival) ?? last;
    arrived = arrival;
  }
  assert.ok(arrived - last >= 0 && arrived - last < 35_000, `${arrived - last} us`);
});

test("stamps that go back or repeat give nothing", () => {
  const clock = new ArrivalClock();
  assert.ok(clock.map(1000, kEpoch));
  assert.equal(clock.map(1000, kEpoch + 10), undefined);
  assert.equal(clock.map(500, kEpoch + 20), undefined);
  assert.ok(clock.map(2000, kEpoch + 1000));
});
