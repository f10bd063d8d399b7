// Writes the output of pangea-agent: trajectories in TUM's format, and keyframes as an LCM log.

import { closeSync, openSync, writeSync } from "node:fs";

import type { PhonePose } from "../agent/phone_agent";

const kLogMagic = 0xeda1da01;
const kUtimeOffset = 24; // of utime in keyframe_t and its successors: after the fingerprint and the id

export class TumFiles {
  private file?: number;
  private map = "";
  private maps = 0;

  constructor(private readonly path: string) {}

  // Writes a tracked pose. Each map has its own file.
  write({ utime, map, T_odom_body }: PhonePose) {
    if (map !== this.map) {
      this.close();
      this.map = map;
      this.file = openSync(++this.maps > 1 ? `${this.path}.${this.maps}` : this.path, "w");
    }
    const stamp = `${Math.floor(utime / 1e6)}.${String(utime % 1e6).padStart(6, "0")}`;
    writeSync(this.file!, `${stamp} ${T_odom_body.map((value) => value.toFixed(9)).join(" ")}\n`);
  }

  close() {
    if (this.file !== undefined) closeSync(this.file);
    this.file = undefined;
  }
}

export class KeyframeLog {
  private readonly file: number;
  private count = 0n;

  constructor(path: string, private readonly agent: number) {
    this.file = openSync(path, "w");
  }

  write(keyframe: Uint8Array) {
    const channel = new TextEncoder().encode(`KEYFRAME_${this.agent}`);
    const header = new DataView(new ArrayBuffer(28));
    header.setUint32(0, kLogMagic);
    header.setBigInt64(4, this.count++);
    header.setBigInt64(12, new DataView(keyframe.buffer, keyframe.byteOffset).getBigInt64(kUtimeOffset));
    header.setInt32(20, channel.length);
    header.setInt32(24, keyframe.length);
    for (const part of [new Uint8Array(header.buffer), channel, keyframe]) writeSync(this.file, part);
  }

  close() {
    closeSync(this.file);
  }
}
