// Reads a PNG as grey pixels. Only its first channel is used, which is right for grey images.

import { PNG } from "pngjs";

export function lumaOf(file: Uint8Array): { luma: Uint8Array; width: number; height: number } {
  const { data, width, height } = PNG.sync.read(Buffer.from(file));
  const luma = new Uint8Array(width * height);
  for (let i = 0; i < luma.length; ++i) luma[i] = data[4 * i];
  return { luma, width, height };
}
