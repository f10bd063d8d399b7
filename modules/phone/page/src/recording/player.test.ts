import assert from "node:assert/strict";
import { mock, test } from "node:test";
import type { Recording } from "./euroc";
import { Player } from "./player";
import type { RecordedPicture } from "./player";

const kSecond_us = 1_000_000;

test("a player that is stopped while it waits gives no more, and frees the image that it has", async () => {
  let open = 0;
  mock.method(Player, "load", async ({ images }: Recording, index: number) => {
    ++open;
    return { utime: images[index].utime, picture: { close: () => --open } };
  });
  const images = [0, 1, 2].map((i) => ({ utime: 0.5 * i * kSecond_us, name: `${i}.png` }));
  const recording: Recording = { files: { names: [], read: async () => new Uint8Array() }, imuYaml: "", imu: [], images };
  const given: number[] = [];
  const addImage = async ({ utime, picture }: RecordedPicture) => {
    given.push(utime);
    picture.close();
  };
  const player = new Player(recording, { addImu: () => {}, addImage }, true);
  await player.play(() => void setTimeout(() => player.stop(), 20));
  assert.deepEqual(given, [0]);
  assert.equal(open, 0);
});
