// Writes a recording in EuRoC's format to a zip while it is made. Nothing is compressed, because images already are, and compressing the
// rest would interrupt the sensors of a walk that goes on. The pieces are blobs, which the browser may keep on its disk.

import { Zip, ZipPassThrough } from "fflate";
import type { ImuSample } from "./euroc";

const kPartBytes = 4_000_000;
const kRowsAtOnce = 2000; // a few milliseconds
// Below the bounds of a zip: 65,535 files and 4 GiB.
const kMaxImages = 65_000; // 36 minutes at 30 Hz
const kMaxBytes = 4_000_000_000;

const nanoseconds = (utime: number) => `${utime}000`;

export class RecordingWriter {
  private readonly parts: Blob[] = [];
  private recent: Uint8Array<ArrayBuffer>[] = [];
  private recentBytes = 0;
  private bytes = 0;
  private readonly zip: Zip;
  private failure?: Error;
  private readonly imageRows = ["#timestamp [ns],filename"];
  private readonly imuRows = [
    "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1]," +
      "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]",
  ];
  numImages = 0;

  // `folder`: the name of the recording, the folder that contains mav0.
  constructor(private readonly folder: string) {
    this.zip = new Zip((error, data) => {
      if (error) this.failure = error;
      else this.keep(data as Uint8Array<ArrayBuffer>);
    });
  }

  // No further image may be added.
  get isFull(): boolean {
    return this.numImages >= kMaxImages || this.bytes >= kMaxBytes;
  }

  // `extension`: the format of `encoded`, jpg or png.
  addImage(utime: number, encoded: Uint8Array, extension: string) {
    const name = `${nanoseconds(utime)}.${extension}`;
    this.imageRows.push(`${nanoseconds(utime)},${name}`);
    this.add(`cam0/data/${name}`, encoded);
    ++this.numImages;
  }

  addImu({ utime, gyro, accel }: ImuSample) {
    this.imuRows.push([nanoseconds(utime), ...[...gyro, ...accel].map((v) => v.toFixed(9))].join(","));
  }

  // Returns the zip. Nothing can be added afterwards.
  async finish(cameraYaml: string, imuYaml: string): Promise<Blob> {
    await this.addRows("cam0/data.csv", this.imageRows);
    await this.addRows("imu0/data.csv", this.imuRows);
    this.add("cam0/sensor.yaml", new TextEncoder().encode(cameraYaml));
    this.add("imu0/sensor.yaml", new TextEncoder().encode(imuYaml));
    this.zip.end();
    if (this.failure) throw this.failure;
    return new Blob([...this.parts, ...this.recent], { type: "application/zip" });
  }

  private keep(data: Uint8Array<ArrayBuffer>) {
    this.recent.push(data);
    this.bytes += data.length;
    this.recentBytes += data.length;
    if (this.recentBytes < kPartBytes) return;
    this.parts.push(new Blob(this.recent));
    this.recent = [];
    this.recentBytes = 0;
  }

  private begin(name: string): ZipPassThrough {
    const file = new ZipPassThrough(`${this.folder}/mav0/${name}`);
    this.zip.add(file);
    return file;
  }

  private add(name: string, content: Uint8Array) {
    this.begin(name).push(content, true);
  }

  // Slice by slice; in between, the browser does other things.
  private async addRows(name: string, rows: string[]) {
    const file = this.begin(name);
    for (let i = 0; i < rows.length; i += kRowsAtOnce) {
      const slice = new TextEncoder().encode(`${rows.slice(i, i + kRowsAtOnce).join("\n")}\n`);
      file.push(slice, i + kRowsAtOnce >= rows.length);
      await new Promise((done) => setTimeout(done));
    }
  }
}
