// One visit: first an unknown camera is calibrated; then an agent runs with the phone's sensors, the device's odometry or a recording.

import type { PhonePose } from "./agent/phone_agent";
import { CalibrationWalk } from "./calibration/calibration_walk";
import type { Membership } from "./messages";
import { isCalibrated, openRecording, withCamera } from "./recording/euroc";
import type { CalibratedRecording, Recording } from "./recording/euroc";
import type { Files } from "./recording/files";
import type { Recorder } from "./recording/recorder";
import { roughCalibration, storeCalibration, storedCalibration } from "./sensors/calibration";
import type { CameraKind } from "./sensors/calibration";
import { Camera } from "./sensors/camera";
import { askForMotion } from "./sensors/motion";
import { parseCamera } from "./view/camera_model";
import type { Stage } from "./view/stage";
import { WakeLock } from "./wake_lock";
import { Walk } from "./walk";
import type { WalkEvents } from "./walk";
import { XrOdometry } from "./xr/xr_odometry";

const kNotKept = "This browser does not keep the calibration.";

export interface VisitEvents {
  onEnter(): void; // from now on a camera image is shown
  onLeave(): void;
  onPose(pose: PhonePose): void;
  onRecorded(recorder: Recorder): void; // a recording has ended and is to be saved
  onNotice(text: string): void;
}

export interface VisitOptions {
  ownOdometry: boolean; // use our odometry even if the device has one
  realTime: boolean; // of recordings
}

export class Visit {
  walk?: Walk;
  calibration?: CalibrationWalk;
  skipCalibration?: () => void; // set if the visitor may continue without calibration
  isLive = false;
  playedShare = 0; // of a recording
  private readonly wakeLock = new WakeLock();
  private camera?: CameraKind; // the newest live one
  private xr?: XrOdometry;
  private xrFails = false;
  private readonly hasXr: Promise<boolean>;
  private run = 0; // number of the newest start; a start that was overtaken, or left, stops what it has opened and ends
  private endCalibration = (_cameraYaml: string | undefined) => {};
  private readonly walkEvents: WalkEvents;

  // `admit`: joins with the invite code, if one was given.
  constructor(
    private readonly stage: Stage,
    private readonly admit: () => Promise<Membership | undefined>,
    private readonly events: VisitEvents,
    private readonly options: VisitOptions,
  ) {
    this.hasXr = options.ownOdometry ? Promise.resolve(false) : XrOdometry.isSupported();
    const { onPose, onNotice } = events;
    this.walkEvents = { onPose, onNotice, onFailure: (text) => (this.leave(), onNotice(text)) };
  }

  get usesXr(): boolean {
    return this.xr !== undefined;
  }

  // Must be called within a tap.
  startLive(): Promise<void> {
    return this.start((run) => this.openLive(run));
  }

  startRecorded(files: Files): Promise<void> {
    return this.start((run) => this.openRecorded(run, files));
  }

  leave() {
    this.supersede();
    this.wakeLock.release();
    this.walk?.stop();
    this.stage.clear();
    this.events.onLeave();
  }

  // Hands out the running recording, if there is one. Whatever ends a walk calls it first, so that no recording is lost.
  finishRecording() {
    const recorder = this.walk?.recorder;
    if (!recorder) return;
    this.walk!.recorder = undefined;
    this.events.onRecorded(recorder);
  }

  // The tab was hidden or is visible again.
  onVisibility(isHidden: boolean) {
    if (!this.isLive) return;
    if (isHidden) this.walk?.endMap();
    else this.wakeLock.keep();
  }

  // Stores a sensor.yaml of this phone's camera, as pangea-calibrate writes it. A calibration that runs ends with it.
  keepCalibration(yaml: string) {
    const { camera } = this;
    if (!camera) throw new Error("Start once, so that the camera is known; then drop its sensor.yaml again.");
    const { width, height } = parseCamera(yaml, "sensor.yaml");
    if (width !== camera.width || height !== camera.height) {
      throw new Error(`sensor.yaml: field 'resolution' is ${width} x ${height}, the camera gives ${camera.width} x ${camera.height}`);
    }
    if (!storeCalibration(camera, yaml)) throw new Error(kNotKept);
    if (this.isLive) this.endCalibration(yaml);
  }

  // A start that fails leads back, unless it was overtaken: then nobody waits for it, and the newer walk goes on.
  private async start(open: (run: number) => Promise<void>) {
    const run = this.supersede();
    try {
      await open(run);
    } catch (error) {
      if (run !== this.run) return;
      this.leave();
      throw error;
    }
  }

  // Ends starts that are under way, the recording and the device's session. Returns the number of the next start.
  private supersede(): number {
    const run = ++this.run;
    this.finishRecording();
    this.endCalibration(undefined);
    const device = this.xr;
    this.xr = undefined;
    device?.stop();
    return run;
  }

  private async openLive(run: number) {
    if (!this.xrFails && (await this.hasXr) && (await this.startXr(run))) return;
    await askForMotion(); // before all else, because iOS asks only within the tap
    const membership = await this.begin(run, true);
    if (run !== this.run) return;
    const sensor = await Camera.open();
    try {
      const cameraYaml = run === this.run ? await this.calibrationOf(sensor) : undefined;
      if (!cameraYaml || run !== this.run) return sensor.stop();
      this.walk = Walk.live(sensor, cameraYaml, membership, this.stage, this.walkEvents);
    } catch (error) {
      sensor.stop();
      throw error;
    }
    this.events.onEnter();
  }

  // The stored one, or a new one; undefined if the start was overtaken or left.
  private async calibrationOf(sensor: Camera): Promise<string | undefined> {
    const kind = (this.camera = sensor.kind);
    this.wakeLock.keep();
    return storedCalibration(kind) ?? (await this.calibrateLive(sensor, kind));
  }

  private async openRecorded(run: number, files: Files) {
    const recording = await openRecording(files);
    const membership = await this.begin(run, false);
    if (run !== this.run) return;
    const calibrated = isCalibrated(recording) ? recording : await this.calibrateRecording(run, recording);
    if (!calibrated || run !== this.run) return;
    const onProgress = (share: number) => (this.playedShare = share);
    this.walk = Walk.play(calibrated, this.options.realTime, membership, this.stage, this.walkEvents, onProgress);
    this.events.onEnter();
  }

  private async begin(run: number, isLive: boolean): Promise<Membership | undefined> {
    if (run !== this.run) return;
    const membership = await this.admit();
    if (run !== this.run) return;
    await this.walk?.close();
    if (run !== this.run) return;
    this.walk = undefined;
    this.isLive = isLive;
    return membership;
  }

  // False if it does not work, for instance if the browser gives no images; then our odometry is used.
  private async startXr(run: number): Promise<boolean> {
    const device = await XrOdometry.open(this.stage.overlay.renderer, document.body).catch((error) => console.info(`WebXR: ${error}`));
    if (!device) return false;
    if (run !== this.run) return device.stop(), true;
    this.xr = device;
    device.onEnd = () => {
      if (this.xr !== device) return;
      this.leave();
      this.xrFails = device.isBlind;
      if (device.isBlind) this.events.onNotice("AR gives no camera images here. Start again: the page tracks by itself then.");
    };
    const membership = await this.begin(run, true);
    if (run !== this.run) return true;
    this.wakeLock.keep();
    device.onCamera = async (cameraYaml) => {
      const newest = ++this.run; // a screen that is rotated there and back starts two walks
      await this.walk?.close();
      if (newest !== this.run) return;
      this.walk = Walk.xr(device, cameraYaml, membership, this.stage, this.walkEvents);
      this.events.onEnter();
    };
    device.start();
    this.events.onEnter();
    return true;
  }

  private async calibrateLive(sensor: Camera, kind: CameraKind): Promise<string | undefined> {
    const rough = roughCalibration(kind);
    const walk = CalibrationWalk.live(sensor, parseCamera(rough, "rough"), this.stage);
    const cameraYaml = await this.calibrate(walk, rough);
    const isNew = cameraYaml !== undefined && cameraYaml !== rough;
    if (isNew && !storeCalibration(kind, cameraYaml)) this.events.onNotice(kNotKept);
    return cameraYaml;
  }

  private async calibrateRecording(run: number, recording: Recording): Promise<CalibratedRecording | undefined> {
    const walk = await CalibrationWalk.ofRecording(recording, this.stage);
    if (run !== this.run) return void walk.stop();
    const cameraYaml = await this.calibrate(walk);
    return cameraYaml === undefined ? undefined : withCamera(recording, cameraYaml, "the calibration");
  }

  // Undefined if it was ended without a result. `otherwise`: a calibration with which the visitor may continue at once.
  private async calibrate(walk: CalibrationWalk, otherwise?: string): Promise<string | undefined> {
    this.calibration = walk;
    this.skipCalibration = otherwise === undefined ? undefined : () => this.endCalibration(otherwise);
    this.events.onEnter();
    const ended = new Promise<string | undefined>((done) => (this.endCalibration = done));
    try {
      return await Promise.race([walk.done, ended]);
    } finally {
      walk.stop();
      this.calibration = this.skipCalibration = undefined;
    }
  }
}
