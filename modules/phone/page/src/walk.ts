// One walk of an agent: its sensors, live or played, its worker, and its newest state, which the page draws.

import { AgentClient } from "./agent_client";
import { openingTime } from "./agent/opening_time";
import type { PhonePose, ProcessStatus, DrawnAnchor } from "./agent/phone_agent";
import type { FromWorker, LinkState, Membership } from "./messages";
import type { CalibratedRecording, ImuSample } from "./recording/euroc";
import { Player } from "./recording/player";
import type { RecordedPicture } from "./recording/player";
import { Recorder } from "./recording/recorder";
import { kPhoneImu } from "./sensors/calibration";
import type { Camera, CameraImage } from "./sensors/camera";
import { utimeOf } from "./sensors/clock";
import { brightnessOf } from "./sensors/luma";
import { OtherAgents } from "./other_agents";
import { Motion } from "./sensors/motion";
import { NewestFrame } from "./sensors/newest_frame";
import { parseCamera } from "./view/camera_model";
import type { CameraModel } from "./view/camera_model";
import { matrixOf } from "./view/poses";
import type { Stage } from "./view/stage";
import type { XrFrame, XrImage, XrOdometry } from "./xr/xr_odometry";

const kCameraSilence_ms = 3000;

export interface WalkEvents {
  onPose(pose: PhonePose): void;
  onNotice(text: string): void;
  onFailure(text: string): void;
}

export class Walk {
  pose?: PhonePose;
  anchors: DrawnAnchor[] = [];
  readonly others = new OtherAgents();
  link?: LinkState;
  vio?: ProcessStatus;
  uplink?: ProcessStatus;
  isMemoryFull = false; // the uplink has refused keyframes since the server was last connected
  brightness = 255;
  motionSilent = false;
  numImages = 0; // number of images that the agent has processed
  recorder?: Recorder;
  private newestImage_ms?: number; // when the phone's camera gave it; undefined with other input
  private stopSensors = () => {};
  private readonly client: AgentClient;
  private taken = () => {}; // called when the agent has processed its image

  private constructor(
    public camera: CameraModel, // as refined by the odometry
    private readonly yaml: { camera: string; imu?: string }, // without imu: images have the device's poses
    readonly membership: Membership | undefined,
    private readonly stage: Stage,
    private readonly events: WalkEvents,
  ) {
    this.link = membership && "connecting";
    const openedUtime = openingTime(utimeOf(performance.now()));
    const open = { kind: "open", membership, cameraYaml: yaml.camera, imuYaml: yaml.imu, openedUtime, devicePoses: !yaml.imu } as const;
    this.client = new AgentClient(open, (message) => this.take(message));
  }

  // A walk with the phone's own sensors. It stops the camera when it stops.
  static live(camera: Camera, cameraYaml: string, membership: Membership | undefined, stage: Stage, events: WalkEvents): Walk {
    const model = parseCamera(cameraYaml, "the stored calibration");
    const walk = new Walk(model, { camera: cameraYaml, imu: kPhoneImu }, membership, stage, events);
    walk.newestImage_ms = performance.now();
    camera.onImage = (image) => walk.onCamera(image);
    camera.onEnd = ({ message }) => events.onFailure(message);
    const motion = new Motion((sample) => walk.addImu(sample), () => (walk.motionSilent = true));
    walk.stopSensors = () => {
      camera.stop();
      motion.stop();
      walk.frames.stop();
    };
    return walk;
  }

  // A walk with the device's odometry. The device's session continues when the walk stops.
  static xr(device: XrOdometry, cameraYaml: string, membership: Membership | undefined, stage: Stage, events: WalkEvents): Walk {
    const walk = new Walk(parseCamera(cameraYaml, "the device's camera"), { camera: cameraYaml }, membership, stage, events);
    const images = new NewestFrame<XrImage>((image) => walk.giveToAgent(image), () => {});
    walk.taken = () => images.done();
    device.onImage = (image) => images.add(image);
    device.onFrame = (frame) => walk.showThrough(frame);
    walk.stopSensors = () => {
      device.onImage = device.onFrame = undefined;
      images.stop();
    };
    return walk;
  }

  // A walk with a recording instead of sensors. `onImage` gets the share that was played.
  static play(
    recording: CalibratedRecording, realTime: boolean, membership: Membership | undefined, stage: Stage, events: WalkEvents,
    onImage: (share: number) => void,
  ): Walk {
    const yaml = { camera: recording.cameraYaml, imu: recording.imuYaml };
    const walk = new Walk(recording.camera, yaml, membership, stage, events);
    const sink = {
      addImu: (samples: ImuSample[]) => walk.client.addImu(samples),
      addImage: (image: RecordedPicture) => {
        const taken = new Promise<void>((done) => (walk.taken = done));
        walk.giveToAgent(image);
        return taken;
      },
    };
    const player = new Player(recording, sink, realTime);
    walk.stopSensors = () => player.stop();
    player.play(onImage).then(() => walk.endMap(), (error) => player.isStopped || events.onFailure(error.message));
    return walk;
  }

  placeAnchor(name: string, utime: number, pixel: [number, number]) {
    this.client.say({ kind: "place", edit: { name, payload: "", utime, pixel } });
  }

  removeAnchor(id: string) {
    this.client.say({ kind: "remove", id });
  }

  // The sensors pause or end: the map ends cleanly, and later images open a new one.
  endMap() {
    this.client.say({ kind: "end_map" });
  }

  // The agent runs on until close, to send what the server does not have yet.
  stop() {
    this.stopSensors();
    this.endMap();
  }

  close(): Promise<void> {
    this.stopSensors();
    return this.client.close();
  }

  startRecording() {
    this.recorder = new Recorder(`walk_${new Date().toISOString().replace(/[:.]/g, "-")}`, this.yaml.camera, this.yaml.imu ?? kPhoneImu);
  }

  // The camera is open, but gives no images, for instance because another app has taken it.
  get cameraSilent(): boolean {
    return this.newestImage_ms !== undefined && performance.now() - this.newestImage_ms > kCameraSilence_ms;
  }

  // Number of keyframes and edits of anchors that the server has not acknowledged.
  get numUnsent(): number {
    return this.uplink?.counters.pending ?? 0;
  }

  private readonly frames = new NewestFrame<CameraImage>(
    (image) => this.giveToAgent(image),
    ({ picture }) => picture.close(),
  );

  private onCamera(image: CameraImage) {
    this.newestImage_ms = performance.now();
    this.recorder?.addImage(image);
    this.frames.add(image);
  }

  private addImu(sample: ImuSample) {
    this.motionSilent = false;
    this.recorder?.addImu(sample);
    this.client.addImu([sample]);
  }

  private giveToAgent(image: CameraImage | RecordedPicture | XrImage) {
    const isLost = "T_odom_body" in image && image.T_odom_body === null;
    if (!isLost) this.brightness = brightnessOf(image);
    if ("picture" in image) this.stage.keep(image.utime, image.picture);
    this.client.addImage(image);
  }

  // Draws the things over a camera image that the device shows itself, with the pose of this frame. Taps use the agent's newest image.
  private showThrough({ T_odom_body, target }: XrFrame) {
    if (!this.pose) return;
    const pose: PhonePose = { ...this.pose, T_odom_body };
    this.stage.showThrough(this.camera, pose, this.anchors, this.others.in(pose.map, performance.now()), target);
  }

  private take(message: FromWorker) {
    switch (message.kind) {
      case "failed":
        this.stopSensors();
        return this.events.onFailure(message.text);
      case "taken":
        ++this.numImages;
        this.taken();
        return this.frames.done();
      case "pose":
        this.pose = message.pose;
        this.stage.show(this.camera, message.pose, this.anchors, this.others.in(message.pose.map, performance.now()));
        return this.events.onPose(message.pose);
      case "camera":
        this.camera = { ...message.camera, T_body_cam: matrixOf(message.camera.T_body_cam) };
        return;
      case "anchors":
        this.anchors = message.anchors;
        return;
      case "others":
        return this.others.take(message.told, performance.now());
      case "status":
        return this.takeStatus(message);
      case "refused":
        return this.events.onNotice(`The anchor was not placed: ${message.text}`);
      case "storage_failed":
        return this.events.onNotice(`This browser does not keep what is unsent: ${message.text}`);
    }
  }

  private takeStatus({ vio, uplink, link }: Extract<FromWorker, { kind: "status" }>) {
    const numRefused = (status?: ProcessStatus) => status?.counters.keyframes_spool_full ?? 0;
    const refuses = numRefused(uplink) > numRefused(this.uplink);
    this.isMemoryFull = link !== "open" && (refuses || this.isMemoryFull);
    this.vio = vio ?? this.vio;
    this.uplink = uplink ?? this.uplink;
    this.link = link;
  }
}
