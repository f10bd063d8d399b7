// Emulates a phone's sensors with a rendered recording: its images are the file of Chromium's fake camera, its motion is given to
// DevTools' virtual sensors. Before the recording come uniform grey images, each with another grey; each of them tells when the
// recording begins.

import { closeSync, existsSync, openSync, readdirSync, readFileSync, renameSync, writeSync } from "node:fs";
import { PNG } from "pngjs";

const kRate_hz = 20;
const kLeadIn = 4 * kRate_hz; // images
const kDarkest = 10; // of the lead-in, whose every image is kBrighter brighter than the one before
const kBrighter = 3;
const kKnownAt = kLeadIn - kRate_hz; // when its begin is told
const kFeed_ms = 8; // twice as often as browsers look

// Writes all images of the recording as YUV 4:2:0 with all 256 grey levels, unless the file exists.
export function cameraFile(recording) {
  const file = `${recording}/camera.y4m`;
  if (existsSync(file)) return file;
  const names = readdirSync(`${recording}/mav0/cam0/data`).filter((name) => name.endsWith(".png")).sort();
  const { width, height } = PNG.sync.read(readFileSync(`${recording}/mav0/cam0/data/${names[0]}`));
  const pixels = width * height;
  const chroma = Buffer.alloc(pixels / 2, 128);
  const out = openSync(`${file}.part`, "w");
  const write = (luma) => [Buffer.from("FRAME\n"), luma, chroma].forEach((bytes) => writeSync(out, bytes));
  writeSync(out, `YUV4MPEG2 W${width} H${height} F${kRate_hz}:1 Ip A1:1 C420jpeg\n`);
  for (let i = 0; i < kLeadIn; ++i) write(Buffer.alloc(pixels, kDarkest + kBrighter * i));
  for (const name of names) {
    const { data } = PNG.sync.read(readFileSync(`${recording}/mav0/cam0/data/${name}`));
    const luma = Buffer.alloc(pixels);
    for (let i = 0; i < pixels; ++i) luma[i] = data[4 * i];
    write(luma);
  }
  closeSync(out);
  renameSync(`${file}.part`, file);
  return file;
}

export class EmulatedPhone {
  begun = new Promise((done) => (this.onBegun = done)); // when offset_us is known

  // Offset from the page's time stamps to the recording's.
  get offset_us() {
    return this.firstImage - this.began_us;
  }

  // `page` must not be started yet, because its camera begins when it is.
  static async on(page, recording) {
    const phone = new EmulatedPhone();
    phone.devtools = await page.context().newCDPSession(page);
    phone.samples = readFileSync(`${recording}/mav0/imu0/data.csv`, "utf8").split("\n").filter((line) => /^\d/.test(line))
      .map((line) => line.split(",")).map(([stamp, ...values]) => ({ utime: Number(stamp.slice(0, -3)), values: values.map(Number) }));
    phone.firstImage = Number(readdirSync(`${recording}/mav0/cam0/data`).sort()[0].slice(0, 16));
    for (const type of ["accelerometer", "linear-acceleration", "gyroscope"]) {
      await phone.devtools.send("Emulation.setSensorOverrideEnabled", { enabled: true, type, metadata: { available: true } });
    }
    phone.set(phone.samples[0].values);
    await page.evaluate(([leadIn, darkest, brighter, knownAt, period_us]) => {
      const { stage } = pangea;
      const keep = stage.keep;
      let begin_us = Infinity;
      stage.keep = (utime, picture) => {
        const i = ((pangea.walk?.brightness ?? 0) - darkest) / brighter;
        // A time stamp may be late, but is never early.
        if (Number.isInteger(i) && i > 0) begin_us = Math.min(begin_us, utime + (leadIn - i) * period_us);
        if (i > knownAt) window.begin_us ??= begin_us;
        keep.call(stage, utime, picture);
      };
    }, [kLeadIn, kDarkest, kBrighter, kKnownAt, 1e6 / kRate_hz]);
    return phone;
  }

  // Waits for the beginning, and feeds motion until the end of the recording.
  async play(page) {
    await page.waitForFunction(() => window.begin_us, undefined, { polling: 5, timeout: 120_000 });
    this.began_us = await page.evaluate(() => begin_us);
    this.onBegun();
    await new Promise((done) => {
      let next = 0;
      const feed = setInterval(() => {
        const utime = 1000 * (performance.timeOrigin + performance.now()) + this.offset_us;
        while (next < this.samples.length && this.samples[next].utime < utime) ++next;
        if (next === this.samples.length) return clearInterval(feed), done();
        this.set(this.samples[next].values);
      }, kFeed_ms);
    });
  }

  set([gx, gy, gz, ax, ay, az]) {
    const send = (type, x, y, z) => this.devtools.send("Emulation.setSensorOverrideReadings", { type, reading: { xyz: { x, y, z } } }).catch(() => {});
    send("gyroscope", gx, gy, gz);
    send("accelerometer", ax, ay, az);
    send("linear-acceleration", ax, ay, az);
  }
}
