// Writes a recording in EuRoC's format to a zip while it is made. Nothing is compressed, because images already are, and compressing the
// rest would interrupt the sensors of a walk that goes on.

import type { ImuSample } from "./euroc";
import { ZipWriter } from "./zip_writer";

const kRowsAtOnce = 1000; // a few milliseconds
// Below the bounds of a zip: 65,535 files and 4 GiB.
const kMaxImages = 65_000; // 36 minutes at 30 Hz
const kMaxBytes = 4_000_000_000;

const nanoseconds = (utime: number) => `${utime}000`;

export class RecordingWriter {
  private readonly zip = new ZipWriter();
  private readonly imageRows = ["#timestamp [ns],filename"];
  private readonly imuRows = [
    "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1]," +
      "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]",
  ];
  numImages = 0;

  // `folder`: the name of the recording, the folder that contains mav0.
  constructor(private readonly folder: string) {}

  // No further image may be added.
  get isFull(): boolean {
    return this.numImages >= kMaxImages || this.zip.bytes >= kMaxBytes;
  }

  // `extension`: the format of `encoded`, jpg or png.
  addImage(utime: number, encoded: Uint8Array, extension: string) {
    const name = `${nanoseconds(utime)}.${extension}`;
    this.imageRows.push(`${nanoseconds(utime)},${name}`);
    this.zip.add(`${this.folder}/mav0/cam0/data/${name}`, encoded);
    ++this.numImages;
  }

  addImu({ utime, gyro, accel }: ImuSample) {
    this.imuRows.push([nanoseconds(utime), ...[...gyro, ...accel].map((v) => v.toFixed(9))].join(","));
  }

  // Returns the zip. Nothing can be added afterwards.
  async finish(cameraYaml: string, imuYaml: string): Promise<Blob> {
    const mav0 = `${this.folder}/mav0`;
    await this.zip.addSlices(`${mav0}/cam0/data.csv`, encoded(this.imageRows));
    await this.zip.addSlices(`${mav0}/imu0/data.csv`, encoded(this.imuRows));
    this.zip.add(`${mav0}/cam0/sensor.yaml`, new TextEncoder().encode(cameraYaml));
    this.zip.add(`${mav0}/imu0/sensor.yaml`, new TextEncoder().encode(imuYaml));
    return this.zip.finish();
  }
}

function* encoded(rows: string[]): Iterable<Uint8Array> {
  for (let i = 0; i < rows.length; i += kRowsAtOnce) {
    yield new TextEncoder().encode(`${rows.slice(i, i + kRowsAtOnce).join("\n")}\n`);
  }
}
