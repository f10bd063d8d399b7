// The device's own odometry (ARCore, in Chrome on Android) by WebXR: an immersive-ar session in which each frame has a pose and, by
// camera-access, the image that belongs to it. The session shows the camera's image itself, and the page over it (dom-overlay).

import type { WebGLRenderer } from "three";
import { WebGLRenderTarget } from "three";
import type { Pose7 } from "../agent/phone_agent";
import { utimeOf } from "../sensors/clock";
import type { Luma } from "../sensors/luma";
import type { Size } from "../view/fit";
import { CameraReadback, greySizeOf } from "./camera_readback";
import { cameraYamlOf, odomPose } from "./frames";

const kImageInterval_ms = 95; // about ten images per second, so that features can be tracked between them
const kNoCamera_ms = 5000; // longest time with poses but without camera images

export interface XrImage extends Luma {
  utime: number;
  T_odom_body: Pose7 | null; // null: the odometry is lost, and the image is black
}

// A frame that is about to be shown.
export interface XrFrame {
  T_odom_body: Pose7;
  target: WebGLRenderTarget; // drawn over the camera's image
}

export class XrOdometry {
  onImage?: (image: XrImage) => void;
  onFrame?: (frame: XrFrame) => void;
  onCamera?: (cameraYaml: string) => void; // called before the first image and when the screen was rotated
  onEnd?: () => void; // the session has ended
  isBlind = false; // it was ended because it gives no camera images
  private readonly readback: CameraReadback;
  private readonly binding: XRWebGLBinding;
  private readonly target: WebGLRenderTarget;
  private size?: Size; // of images
  private started?: Omit<XrImage, keyof Luma>; // time and pose of the image that is being read back
  private newest_ms = -Infinity; // when the last image was started
  private blindSince_ms?: number; // since when there are poses but no camera images
  private ended = false;

  static async isSupported(): Promise<boolean> {
    return (await navigator.xr?.isSessionSupported("immersive-ar").catch(() => false)) ?? false;
  }

  // Must be called within a tap. Throws the browser's error: no camera images, no permission.
  static async open(renderer: WebGLRenderer, root: HTMLElement): Promise<XrOdometry> {
    const session = await navigator.xr!.requestSession("immersive-ar", {
      requiredFeatures: ["camera-access", "dom-overlay"],
      domOverlay: { root },
    });
    try {
      const gl = renderer.getContext() as WebGL2RenderingContext;
      await gl.makeXRCompatible();
      const layer = new XRWebGLLayer(session, gl, { alpha: true, antialias: false });
      await session.updateRenderState({ baseLayer: layer });
      return new XrOdometry(renderer, session, layer, await session.requestReferenceSpace("local"));
    } catch (error) {
      await session.end().catch(() => {});
      throw error;
    }
  }

  private constructor(
    private readonly renderer: WebGLRenderer,
    private readonly session: XRSession,
    private readonly layer: XRWebGLLayer,
    private readonly space: XRReferenceSpace,
  ) {
    const gl = renderer.getContext() as WebGL2RenderingContext;
    this.readback = new CameraReadback(gl);
    this.binding = new XRWebGLBinding(session, gl as unknown as WebGLRenderingContext);
    this.target = new WebGLRenderTarget(layer.framebufferWidth, layer.framebufferHeight);
    this.target.texture.colorSpace = renderer.outputColorSpace;
    Object.assign(this.target, { isXRRenderTarget: true }); // three.js: its colours are the screen's
    session.addEventListener("end", () => this.end());
  }

  // Call it after the callbacks are set.
  start() {
    this.session.requestAnimationFrame(this.onAnimationFrame);
  }

  stop() {
    this.session.end().catch(() => {});
    this.end();
  }

  private end() {
    if (this.ended) return;
    this.ended = true;
    this.readback.dispose();
    this.target.dispose();
    this.onEnd?.();
  }

  private readonly onAnimationFrame = (time_ms: number, frame: XRFrame) => {
    if (this.ended) return;
    this.session.requestAnimationFrame(this.onAnimationFrame);
    this.giveImage();
    const pose = frame.getViewerPose(this.space);
    const view = pose?.views.find(({ camera }) => camera);
    if (pose && !view && !this.size && time_ms - (this.blindSince_ms ??= time_ms) > kNoCamera_ms) {
      this.isBlind = true;
      return this.stop();
    }
    if (!pose || pose.emulatedPosition || !view) return this.giveLost(time_ms);
    const T_odom_body = odomPose(view.transform);
    this.readImage(time_ms, view, T_odom_body);
    this.renderer.setRenderTargetFramebuffer(this.target, this.layer.framebuffer as WebGLFramebuffer);
    const { x, y, width, height } = this.layer.getViewport(view)!;
    this.target.viewport.set(x, y, width, height);
    this.onFrame?.({ T_odom_body, target: this.target });
  };

  private readImage(time_ms: number, view: XRView, T_odom_body: Pose7) {
    if (this.readback.isBusy || time_ms - this.newest_ms < kImageInterval_ms) return;
    const texture = this.binding.getCameraImage(view.camera!);
    if (!texture) return;
    const size = greySizeOf(view.camera!);
    if (size.width !== this.size?.width || size.height !== this.size.height) {
      this.size = size;
      this.onCamera?.(cameraYamlOf(view.projectionMatrix, size));
    }
    this.newest_ms = time_ms;
    this.started = { utime: utimeOf(time_ms), T_odom_body };
    this.readback.start(texture, view.camera!);
    this.renderer.resetState();
  }

  private giveImage() {
    const image = this.readback.take();
    if (image && this.started) this.onImage?.({ ...this.started, ...image.size, luma: image.luma, stride: image.size.width });
  }

  private giveLost(time_ms: number) {
    if (!this.size || time_ms - this.newest_ms < kImageInterval_ms) return;
    this.newest_ms = time_ms;
    const { width, height } = this.size;
    this.onImage?.({ utime: utimeOf(time_ms), T_odom_body: null, luma: new Uint8Array(width * height), width, height, stride: width });
  }
}
