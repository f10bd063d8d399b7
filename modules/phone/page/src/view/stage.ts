// The camera image over the whole screen, with the things drawn on it. An image is shown when its pose is known, so that anchors do
// not move in it. It is then a tenth of a second late at most, which nobody notices without looking past the phone.

import type { WebGLRenderTarget } from "three";
import type { PhonePose, OtherAgent, DrawnAnchor } from "../agent/phone_agent";
import type { CameraModel } from "./camera_model";
import { CameraMotion } from "./camera_motion";
import { Fit } from "./fit";
import { Overlay, thingsBefore } from "./overlay";
import type { DrawnThing } from "./overlay";

const kMaxWaiting = 4; // pictures without pose yet

export interface Drawn {
  utime: number; // of the image that is shown
  anchors: (DrawnThing & { id: string })[];
  others: DrawnThing[]; // people
}

export class Stage {
  drawn?: Drawn;
  private readonly waiting = new Map<number, ImageBitmap>();
  private before?: PhonePose;
  readonly overlay: Overlay;

  constructor(
    private readonly canvas: HTMLCanvasElement,
    overlayCanvas: HTMLCanvasElement,
    labels: HTMLElement,
    private readonly nameOf: (agent: number) => string,
    private readonly colourOf: (owner: number) => string,
  ) {
    this.overlay = new Overlay(overlayCanvas, labels);
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.resize();
  }

  // Keeps the picture of an image that the agent is processing.
  keep(utime: number, picture: ImageBitmap) {
    this.waiting.set(utime, picture);
    const [oldest] = this.waiting.keys();
    if (this.waiting.size > kMaxWaiting) this.forget(oldest);
  }

  // Shows the picture of the pose, if it is still there.
  show(camera: CameraModel, pose: PhonePose, anchors: DrawnAnchor[], others: OtherAgent[]) {
    const motion = CameraMotion.between(this.before, pose, camera);
    this.before = pose;
    if (this.present(pose.utime)) this.draw(camera, pose, anchors, others, { motion });
  }

  // For a device that shows its camera's image itself: draws only the things, into `target`.
  showThrough(camera: CameraModel, pose: PhonePose, anchors: DrawnAnchor[], others: OtherAgent[], target: WebGLRenderTarget) {
    this.draw(camera, pose, anchors, others, { target });
  }

  private draw(
    camera: CameraModel, pose: PhonePose, anchors: DrawnAnchor[], others: OtherAgent[],
    { motion, target }: { motion?: CameraMotion; target?: WebGLRenderTarget },
  ) {
    const things = [
      ...anchors.map(({ id, name, owner, T_odom_anchor }) => ({ id, name, owner, T_odom_thing: T_odom_anchor })),
      ...others.map(({ agent, T_odom_cam }) => ({ name: this.nameOf(agent), owner: agent, T_odom_thing: T_odom_cam })),
    ];
    const seen = pose.state === "tracking" ? thingsBefore(camera, pose, things, motion) : [];
    this.overlay.draw(camera, this.onScreen(camera), seen, this.colourOf, target);
    const drawn = seen.map(({ T_cam_thing: _, ...thing }) => thing);
    this.drawn = {
      utime: pose.utime,
      anchors: drawn.flatMap((thing) => (thing.id === undefined ? [] : [{ ...thing, id: thing.id }])),
      others: drawn.filter(({ id }) => id === undefined),
    };
  }

  // Shows a picture that has no pose.
  showAlone(utime: number) {
    this.present(utime);
  }

  private present(utime: number): boolean {
    const picture = this.waiting.get(utime);
    if (!picture) return false;
    const fit = new Fit(picture, this.canvas);
    const [left, top] = fit.toScreen([-0.5, -0.5]);
    this.canvas.getContext("2d")!.drawImage(picture, left, top, fit.scale * picture.width, fit.scale * picture.height);
    for (const waiting of [...this.waiting.keys()]) if (waiting <= utime) this.forget(waiting);
    return true;
  }

  // The pixel of the shown image at a position on the screen; undefined outside the image.
  pixelAt(camera: CameraModel, x: number, y: number): [number, number] | undefined {
    const [u, v] = this.onScreen(camera).toPixel([x, y]);
    return u >= 0 && v >= 0 && u <= camera.width - 1 && v <= camera.height - 1 ? [u, v] : undefined;
  }

  // The position of a pixel of the shown image on the screen.
  screenOf(camera: CameraModel, pixel: [number, number]): [number, number] {
    return this.onScreen(camera).toScreen(pixel);
  }

  clear() {
    for (const utime of [...this.waiting.keys()]) this.forget(utime);
    this.drawn = undefined;
    this.overlay.clear();
    this.canvas.getContext("2d")!.clearRect(0, 0, this.canvas.width, this.canvas.height);
  }

  // In CSS pixels, which are larger than those of the canvas.
  private onScreen(camera: CameraModel): Fit {
    return new Fit(camera, { width: this.canvas.clientWidth, height: this.canvas.clientHeight });
  }

  private forget(utime: number) {
    this.waiting.get(utime)?.close();
    this.waiting.delete(utime);
  }

  private resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (width === 0 || height === 0) return;
    const ratio = Math.min(devicePixelRatio, 2);
    [this.canvas.width, this.canvas.height] = [Math.round(ratio * width), Math.round(ratio * height)];
    this.overlay.resize({ width, height });
  }
}
