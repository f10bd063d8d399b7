// The calibration of an unknown camera: sensor data, live or from a recording, go to the worker that calibrates, until it is done.

import { Quaternion } from "three";
import { packImu } from "../messages";
import type { ImuSample, Recording } from "../recording/euroc";
import { Player } from "../recording/player";
import type { RecordedPicture } from "../recording/player";
import { kPhoneImu } from "../sensors/calibration";
import type { Camera, CameraImage } from "../sensors/camera";
import { brightnessOf } from "../sensors/luma";
import type { Luma } from "../sensors/luma";
import { Motion } from "../sensors/motion";
import { NewestFrame } from "../sensors/newest_frame";
import type { CameraModel } from "../view/camera_model";
import type { Stage } from "../view/stage";
import type { CalibrationConfig, CalibrationProgress } from "./camera_calibration";
import type { FromCalibration, ToCalibration } from "./messages";

const kLongest_us = 60_000_000; // longest part of a recording that is used

type Image = Luma & { utime: number; picture: ImageBitmap };

export class CalibrationWalk {
  progress: CalibrationProgress = { share: 0, missing: "time" };
  refused = ""; // why the last try was refused
  brightness = 255;
  motionSilent = false;
  readonly done: Promise<string>; // the camera's sensor.yaml; fails with a text for the visitor; never settles if stopped
  private readonly worker = new Worker(new URL("./worker.ts", import.meta.url), { type: "module" });
  private stopSensors = () => {};
  private taken = () => {}; // called when the worker is done with its image
  private atEnd = false;
  private succeed!: (cameraYaml: string) => void;
  private fail!: (error: Error) => void;

  private constructor(config: CalibrationConfig, private readonly stage: Stage) {
    this.done = new Promise((done, failed) => ([this.succeed, this.fail] = [done, failed]));
    this.worker.onmessage = ({ data }: MessageEvent<FromCalibration>) => this.take(data);
    this.worker.onerror = ({ message }) => this.fail(new Error(message || "The agent's script cannot be loaded."));
    this.say({ kind: "open", config });
  }

  // Calibrates with the phone's own sensors. Only size and rotation of the rough camera are used. The camera stays open.
  static live(camera: Camera, { width, height, T_body_cam }: CameraModel, stage: Stage): CalibrationWalk {
    const q_body_cam = new Quaternion().setFromRotationMatrix(T_body_cam).toArray() as CalibrationConfig["q_body_cam"];
    const walk = new CalibrationWalk({ width, height, imuYaml: kPhoneImu, q_body_cam }, stage);
    const frames = new NewestFrame<CameraImage>((image) => walk.give(image), ({ picture }) => picture.close());
    walk.taken = () => frames.done();
    camera.onImage = (image) => frames.add(image);
    camera.onEnd = (why) => walk.fail(why);
    const motion = new Motion((sample) => walk.addImu([sample]), () => (walk.motionSilent = true));
    walk.stopSensors = () => {
      camera.onImage = undefined;
      motion.stop();
      frames.stop();
    };
    return walk;
  }

  // Calibrates on as much of a recording as needed, at most a minute, as fast as possible.
  static async ofRecording(recording: Recording, stage: Stage): Promise<CalibrationWalk> {
    const first = await Player.load(recording, 0);
    if (!first) throw new Error(`${recording.images[0].name}: the browser cannot read this image`);
    const { width, height } = first;
    first.picture.close();
    const walk = new CalibrationWalk({ width, height, imuYaml: recording.imuYaml }, stage);
    const addImage = (image: RecordedPicture) => {
      const taken = new Promise<void>((done) => (walk.taken = done));
      walk.give(image);
      return taken;
    };
    const images = recording.images.filter(({ utime }) => utime <= recording.images[0].utime + kLongest_us);
    const player = new Player({ ...recording, images }, { addImu: (samples) => walk.addImu(samples), addImage }, false);
    walk.stopSensors = () => player.stop();
    player.play(() => {}).then(() => walk.finish(), walk.fail);
    return walk;
  }

  stop() {
    this.stopSensors();
    this.worker.terminate();
  }

  private finish() {
    this.atEnd = true;
    this.say({ kind: "finish" });
  }

  private addImu(samples: ImuSample[]) {
    if (samples.length > 0) this.motionSilent = false;
    const values = packImu(samples);
    this.say({ kind: "imu", samples: values }, [values.buffer]);
  }

  private give(image: Image) {
    this.brightness = brightnessOf(image);
    this.stage.keep(image.utime, image.picture);
    const { utime, luma, stride } = image;
    this.say({ kind: "image", utime, luma, stride }, [luma.buffer]);
  }

  private say(message: ToCalibration, transfer: Transferable[] = []) {
    this.worker.postMessage(message, transfer);
  }

  private take(message: FromCalibration) {
    switch (message.kind) {
      case "failed":
        return this.fail(new Error(message.text));
      case "taken":
        this.stage.showAlone(message.utime);
        return this.taken();
      case "progress":
        this.progress = message.progress;
        return;
      case "refused":
        this.refused = message.text;
        if (this.atEnd) this.fail(new Error(`This recording does not calibrate its camera: ${message.text}.`));
        return;
      case "done":
        this.stop();
        return this.succeed(message.cameraYaml);
    }
  }
}
