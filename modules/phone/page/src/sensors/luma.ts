// Converts images of a camera or a decoder to grey, as the agent needs them.

export interface Luma {
  luma: Uint8Array;
  width: number;
  height: number;
  stride: number; // bytes per row
}

export interface Picture extends Luma {
  picture: ImageBitmap; // for drawing; whoever has it must close it
}

const kPlanar = ["I420", "I420A", "NV12", "I422", "I444"]; // the first plane is the luma

// Whether the frame is displayed rotated or flipped, as those of a phone's camera that is built in sideways. TypeScript's library lacks
// both attributes. A browser that lacks them too shows it by the sizes.
function isRotated(frame: VideoFrame & { rotation?: number; flip?: boolean }): boolean {
  const { rotation, flip, visibleRect, displayWidth, displayHeight } = frame;
  return Boolean(rotation) || Boolean(flip) || visibleRect?.width !== displayWidth || visibleRect?.height !== displayHeight;
}

// The frame as it is displayed. Only drawing rotates it: copyTo and (in Chromium) createImageBitmap leave its pixels as they lie.
export async function imageOfFrame(frame: VideoFrame): Promise<Picture> {
  if (isRotated(frame)) return imageOfDrawn(drawn(frame, frame.displayWidth, frame.displayHeight));
  const [luma, picture] = await Promise.all([lumaOfFrame(frame), createImageBitmap(frame)]);
  return { ...luma, picture };
}

export async function imageOfVideo(video: HTMLVideoElement): Promise<Picture> {
  return imageOfDrawn(drawn(video, video.videoWidth, video.videoHeight));
}

// Needs no canvas if the frame has a luma plane.
async function lumaOfFrame(frame: VideoFrame): Promise<Luma> {
  if (!frame.format || !kPlanar.includes(frame.format)) return lumaOfPicture(frame, frame.displayWidth, frame.displayHeight);
  const { width, height } = frame.visibleRect!;
  const bytes = new Uint8Array(frame.allocationSize());
  const [{ offset, stride }] = await frame.copyTo(bytes);
  return { luma: bytes.subarray(offset, offset + stride * height), width, height, stride };
}

export const lumaOfPicture = (picture: CanvasImageSource, width: number, height: number) => lumaOfDrawn(drawn(picture, width, height));

function drawn(picture: CanvasImageSource, width: number, height: number): OffscreenCanvasRenderingContext2D {
  const context = new OffscreenCanvas(width, height).getContext("2d", { willReadFrequently: true })!;
  context.drawImage(picture, 0, 0, width, height);
  return context;
}

function imageOfDrawn(context: OffscreenCanvasRenderingContext2D): Picture {
  return { ...lumaOfDrawn(context), picture: context.canvas.transferToImageBitmap() };
}

function lumaOfDrawn(context: OffscreenCanvasRenderingContext2D): Luma {
  const { width, height } = context.canvas;
  return { luma: lumaOfRgba(context.getImageData(0, 0, width, height).data), width, height, stride: width };
}

// Grey by BT.601, with factors in 256ths. A grey pixel keeps its exact value.
export function lumaOfRgba(rgba: Uint8ClampedArray): Uint8Array {
  const luma = new Uint8Array(rgba.length / 4);
  for (let i = 0; i < luma.length; ++i) {
    luma[i] = (77 * rgba[4 * i] + 150 * rgba[4 * i + 1] + 29 * rgba[4 * i + 2] + 128) >> 8;
  }
  return luma;
}

// Copies the image's rows without the padding to `stride`.
export function packRows(luma: Uint8Array, width: number, height: number, stride: number, into: Uint8Array) {
  for (let row = 0; row < height; ++row) {
    into.set(luma.subarray(row * stride, row * stride + width), row * width);
  }
}

// The mean of every 16th pixel of every 16th row, 0 to 255.
export function brightnessOf({ luma, width, height, stride }: Luma): number {
  let sum = 0;
  let count = 0;
  for (let y = 0; y < height; y += 16) {
    for (let x = 0; x < width; x += 16, ++count) sum += luma[y * stride + x];
  }
  return sum / count;
}
