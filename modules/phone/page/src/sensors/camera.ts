// The back camera: gives images as they come, with times on the page's clock.

import type { CameraKind } from "./calibration";
import { ArrivalClock, utimeOf } from "./clock";
import { imageOfFrame, imageOfVideo } from "./luma";
import type { Picture } from "./luma";

export interface CameraImage extends Picture {
  utime: number; // us
}

const kSettle_ms = 1500; // time for the focus to settle before it is locked

// What the visitor reads in place of the browser's text, by the error's name.
const kWhyNot = new Map([
  ["NotAllowedError", "The browser does not let the page use the camera: allow it in its settings."],
  ["NotFoundError", "The browser finds no camera. Is it allowed to use one?"],
  ["NotReadableError", "The camera cannot be used: close the app or tab that uses it."],
]);

// A class of Chromium that TypeScript's library lacks.
declare class MediaStreamTrackProcessor {
  constructor(init: { track: MediaStreamTrack; maxBufferSize?: number });
  readonly readable: ReadableStream<VideoFrame>;
}

export class Camera {
  onImage?: (image: CameraImage) => void; // without it images are dropped
  onEnd?: (why: Error) => void; // the browser took the camera away
  private stopped = false;

  private constructor(
    private readonly stream: MediaStream,
    readonly video: HTMLVideoElement,
  ) {
    this.track.addEventListener("ended", () => {
      if (!this.stopped) this.onEnd?.(new Error("The browser took the camera away. Start again."));
    });
  }

  // Throws an error with a text for the visitor: no camera, no permission.
  static async open(): Promise<Camera> {
    if (!navigator.mediaDevices) {
      throw new Error("The browser gives this page no camera: trust its certificate, or open it in Chrome or Safari.");
    }
    const stream = await navigator.mediaDevices.getUserMedia({
      audio: false,
      video: { facingMode: "environment", width: { ideal: 640 }, height: { ideal: 480 }, frameRate: { ideal: 30 } },
    }).catch(({ name, message }: Error) => {
      throw new Error(kWhyNot.get(name) ?? message);
    });
    const video = document.createElement("video");
    video.playsInline = video.muted = true;
    video.srcObject = stream;
    const camera = new Camera(stream, video);
    try {
      await video.play();
      if ("MediaStreamTrackProcessor" in window) void camera.readTrack();
      else camera.readVideo();
    } catch (error) {
      camera.stop();
      throw error;
    }
    setTimeout(() => void camera.lockFocus(), kSettle_ms);
    return camera;
  }

  get track(): MediaStreamTrack {
    return this.stream.getVideoTracks()[0];
  }

  // The camera as it delivers images now.
  get kind(): CameraKind {
    const { videoWidth: width, videoHeight: height } = this.video;
    return { label: this.track.label, width, height, angle_deg: screen.orientation?.angle ?? 0 };
  }

  stop() {
    this.stopped = true;
    for (const track of this.stream.getTracks()) track.stop();
  }

  // Locks the focus, if the browser can, because focusing changes the focal length. The exposure stays automatic: people walk into darker
  // rooms, and Chrome on Android locks only the exposure time and resets the gain.
  private async lockFocus() {
    const { focusMode } = (this.track.getCapabilities?.() ?? {}) as { focusMode?: string[] };
    if (!focusMode?.includes("manual")) return;
    await this.track.applyConstraints({ advanced: [{ focusMode: "manual" } as MediaTrackConstraintSet] }).catch(() => {});
  }

  private async readTrack() {
    const clock = new ArrivalClock();
    const reader = new MediaStreamTrackProcessor({ track: this.track, maxBufferSize: 2 }).readable.getReader();
    // Reads to the end of the stream, also after stop(), because waiting frames must be closed too.
    for (;;) {
      const { value: frame, done } = await reader.read();
      if (done) return;
      const utime = this.stopped ? undefined : clock.map(frame.timestamp, utimeOf(performance.now()));
      if (utime === undefined) frame.close();
      else await this.give(utime, () => imageOf(frame));
    }
  }

  // For Safari and Firefox, which has no VideoFrame on Android. captureTime is when the camera took the image; without it, the time of
  // presentation is used.
  private readVideo() {
    const read = () => ("VideoFrame" in window ? imageOf(new VideoFrame(this.video)) : imageOfVideo(this.video));
    let newest = 0;
    const next = async (now: number, { captureTime }: VideoFrameCallbackMetadata) => {
      if (this.stopped) return;
      const utime = utimeOf(captureTime ?? now);
      if (utime > newest) {
        newest = utime;
        await this.give(utime, read);
      }
      this.video.requestVideoFrameCallback(next);
    };
    this.video.requestVideoFrameCallback(next);
  }

  // An image that cannot be read is left out, because the next one may be good.
  private async give(utime: number, read: () => Promise<Picture>) {
    try {
      const image = await read();
      if (this.onImage && !this.stopped) this.onImage({ utime, ...image });
      else image.picture.close();
    } catch (error) {
      console.info(`An image of the camera was left out: ${error}`);
    }
  }
}

// The frame is returned to the camera at once, because the camera has only few frames and stops when all are kept.
const imageOf = (frame: VideoFrame): Promise<Picture> => imageOfFrame(frame).finally(() => frame.close());
