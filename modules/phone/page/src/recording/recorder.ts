// Records the phone's sensors: every camera image as JPEG, every inertial sample, and the calibration that was used.

import type { CameraImage } from "../sensors/camera";
import type { ImuSample } from "./euroc";
import { RecordingWriter } from "./writer";

const kMaxEncoding = 4; // images encoded at once; further ones are left out and counted
const kQuality = 0.92;

export class Recorder {
  numLeftOut = 0; // images
  private readonly writer: RecordingWriter;
  private readonly encoding = new Set<Promise<void>>();

  constructor(
    readonly name: string,
    private readonly cameraYaml: string,
    private readonly imuYaml: string,
  ) {
    this.writer = new RecordingWriter(name);
  }

  get numImages(): number {
    return this.writer.numImages;
  }

  addImu(sample: ImuSample) {
    this.writer.addImu(sample);
  }

  // The caller may close the picture when this returns.
  addImage({ utime, picture, width, height }: CameraImage) {
    if (this.writer.isFull || this.encoding.size >= kMaxEncoding) {
      ++this.numLeftOut;
      return;
    }
    const canvas = new OffscreenCanvas(width, height);
    canvas.getContext("2d")!.drawImage(picture, 0, 0, width, height);
    const leaveOut = () => void ++this.numLeftOut;
    const task: Promise<void> = this.encode(canvas, utime).catch(leaveOut).finally(() => this.encoding.delete(task));
    this.encoding.add(task);
  }

  async finish(): Promise<Blob> {
    await Promise.all(this.encoding);
    return this.writer.finish(this.cameraYaml, this.imuYaml);
  }

  private async encode(canvas: OffscreenCanvas, utime: number) {
    const jpeg = await canvas.convertToBlob({ type: "image/jpeg", quality: kQuality });
    this.writer.addImage(utime, new Uint8Array(await jpeg.arrayBuffer()), "jpg");
  }
}

export function download(blob: Blob, name: string) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}
