// Plays a recording like live sensors: in real time, or as fast as the agent can process it. No image is left out; a slow agent slows
// the player down.

import { lumaOfPicture } from "../sensors/luma";
import type { Luma } from "../sensors/luma";
import type { ImuSample, Recording } from "./euroc";

const kAhead_us = 60_000; // samples are added this far ahead: past an image's last row

export interface RecordedPicture extends Luma {
  utime: number;
  picture: ImageBitmap;
}

interface PlayerSink {
  addImu(samples: ImuSample[]): void;
  // Resolves when the agent has processed the image.
  addImage(image: RecordedPicture): Promise<void>;
}

export class Player {
  isStopped = false;

  // Loads the image with this index; undefined if the browser cannot read it.
  static async load({ files, images }: Recording, index: number): Promise<RecordedPicture | undefined> {
    const { utime, name } = images[index];
    const encoded = await files.read(name);
    const options = { colorSpaceConversion: "none", premultiplyAlpha: "none" } as const;
    const picture = await createImageBitmap(new Blob([encoded as Uint8Array<ArrayBuffer>]), options).catch(() => undefined);
    return picture && { utime, picture, ...lumaOfPicture(picture, picture.width, picture.height) };
  }

  constructor(
    private readonly recording: Recording,
    private readonly sink: PlayerSink,
    private readonly realTime: boolean,
  ) {}

  stop() {
    this.isStopped = true;
  }

  // Plays to the end, or until it is stopped. `onImage` gets the share that was played.
  async play(onImage: (share: number) => void): Promise<void> {
    const { images, imu } = this.recording;
    const began_ms = performance.now();
    let next = 0;
    for (let i = 0; i < images.length && !this.isStopped; ++i) {
      const { utime } = images[i];
      const image = await Player.load(this.recording, i);
      if (this.realTime) await until(began_ms + (utime - images[0].utime) / 1000);
      if (this.isStopped) return image?.picture.close();
      const from = next;
      while (next < imu.length && imu[next].utime <= utime + kAhead_us) ++next;
      this.sink.addImu(imu.slice(from, next));
      if (image) await this.sink.addImage(image);
      onImage((i + 1) / images.length);
    }
  }
}

const until = (time_ms: number) => new Promise((done) => setTimeout(done, Math.max(0, time_ms - performance.now())));
