import "./style.css";
import { agentColour, colours } from "../../../web/page/palette";
import type { AgentPose } from "./agent/phone_agent";
import { askDialog, byId } from "./dom";
import { codeIn, forgetMembership, join, storedMembership } from "./link/join";
import type { Membership } from "./messages";
import { People } from "./people";
import { CalibrationWalk } from "./calibration/calibration_walk";
import { isCalibrated, openRecording, withCamera } from "./recording/euroc";
import type { CalibratedRecording, Recording } from "./recording/euroc";
import { filesOf, filesOfDrop, filesOfZip } from "./recording/files";
import type { Files } from "./recording/files";
import { saveRecording } from "./recording/save";
import { forgetCalibrations, roughCalibration, storeCalibration, storedCalibration, storedCalibrations } from "./sensors/calibration";
import type { CameraKind } from "./sensors/calibration";
import { Camera } from "./sensors/camera";
import { askForMotion } from "./sensors/motion";
import { calibrationHint, hintOf } from "./ui/hints";
import type { Hint } from "./ui/hints";
import { showRing } from "./ui/ring";
import { SmallMap } from "./ui/small_map";
import { parseCamera } from "./view/camera_model";
import { Stage } from "./view/stage";
import { Walk } from "./walk";
import type { WalkEvents } from "./walk";
import { XrOdometry } from "./xr/xr_odometry";

const kNotice_ms = 6000;
const kTapRadius = 36; // CSS pixels around an anchor
const kPanels_ms = 250;

const options = new URLSearchParams(location.hash.slice(1));
const people = new People();
const colourOf = (owner: number) => (owner > 0 ? agentColour(owner) : colours().anchor);
const picture = byId<HTMLCanvasElement>("picture");
const stage = new Stage(picture, byId<HTMLCanvasElement>("overlay"), byId("labels"), (agent) => people.nameOf(agent), colourOf);
const smallMap = new SmallMap(byId<HTMLCanvasElement>("map"));
let membership: Membership | undefined = storedMembership();
let walk: Walk | undefined;
let isLive = false;
let played = 0; // share of a recording

const events: WalkEvents = { onPose, onNotice: notice, onFailure: (text) => (leave(), notice(text)) };

// --- joining, starting, stopping

async function ensureMembership() {
  const code = byId<HTMLInputElement>("code").value.trim();
  if (code === "") return;
  membership = await join(code, byId<HTMLInputElement>("name").value.trim());
  // The code works once: a page that is loaded again must not offer it.
  history.replaceState(null, "", location.pathname);
  byId<HTMLInputElement>("code").value = "";
}

async function startLive() {
  endCalibration(undefined);
  if (!xrFails && (await hasXr) && (await startXr())) return;
  await askForMotion(); // first: iOS asks within the tap only
  await ensureMembership();
  await walk?.close();
  walk = undefined;
  isLive = true;
  const sensor = await Camera.open();
  camera = sensor.kind;
  await navigator.wakeLock?.request("screen").catch(() => {});
  const cameraYaml = storedCalibration(camera) ?? (await calibrateLive(sensor, camera));
  if (!cameraYaml) return;
  walk = Walk.live(sensor, cameraYaml, membership, stage, events);
  enter();
}

// The device's own odometry, where there is one.
const hasXr = options.get("odometry") === "own" ? Promise.resolve(false) : XrOdometry.isSupported();
let xr: XrOdometry | undefined;
let xrFails = false;

// False: ours takes its place, for instance where a browser gives no images.
async function startXr(): Promise<boolean> {
  try {
    xr = await XrOdometry.open(stage.overlay.renderer, document.body);
  } catch (error) {
    console.info(`WebXR: ${error}`);
    return false;
  }
  const device = xr;
  device.onEnd = () => {
    if (!device.hasCamera) xrFails = true;
    if (xr !== device) return;
    leave();
    if (xrFails) notice("AR gives no camera images here. Start again: the page tracks by itself then.");
  };
  await ensureMembership();
  await navigator.wakeLock?.request("screen").catch(() => {});
  isLive = true;
  device.onCamera = async (cameraYaml) => {
    await walk?.close();
    if (xr !== device) return;
    walk = Walk.xr(device, cameraYaml, membership, stage, events);
    enter();
  };
  device.start();
  enter();
  showHint({ text: "Move the phone slowly, so that AR finds its way.", tone: "do" });
  return true;
}

async function startRecorded(files: Files) {
  const recording = await openRecording(files);
  endCalibration(undefined);
  await ensureMembership();
  await walk?.close();
  walk = undefined;
  isLive = false;
  const calibrated = isCalibrated(recording) ? recording : await calibrateRecording(recording);
  if (!calibrated) return;
  walk = Walk.play(calibrated, options.get("rate") !== "max", membership, stage, events, (share) => (played = share));
  enter();
}

let camera: CameraKind | undefined;

// --- calibrating an unknown camera

let calibration: CalibrationWalk | undefined;
let endCalibration = (_cameraYaml: string | undefined) => {};

// Nothing: it was ended without. `otherwise`: what the visitor may go on with at once.
async function cameraYamlOf(run: CalibrationWalk, otherwise?: string): Promise<string | undefined> {
  calibration = run;
  enter();
  byId("skip").hidden = otherwise === undefined;
  byId("skip").onclick = () => endCalibration(otherwise);
  const ended = new Promise<string | undefined>((done) => (endCalibration = done));
  try {
    return await Promise.race([run.done, ended]);
  } finally {
    run.stop();
    calibration = undefined;
    showRing(undefined);
  }
}

async function calibrateLive(sensor: Camera, kind: CameraKind): Promise<string | undefined> {
  const rough = roughCalibration(kind);
  const run = CalibrationWalk.live(sensor, parseCamera(rough, "rough"), stage);
  const cameraYaml = await cameraYamlOf(run, rough).catch((error) => (sensor.stop(), Promise.reject(error)));
  if (!cameraYaml) sensor.stop();
  else if (cameraYaml !== rough) storeCalibration(kind, cameraYaml);
  return cameraYaml;
}

async function calibrateRecording(recording: Recording): Promise<CalibratedRecording | undefined> {
  const cameraYaml = await cameraYamlOf(await CalibrationWalk.ofRecording(recording, stage));
  return cameraYaml === undefined ? undefined : withCamera(recording, cameraYaml, "the calibration");
}

function attempt(what: Promise<void>) {
  byId("notice").textContent = "";
  what.catch((error: Error) => {
    leave();
    notice(error.name === "NotAllowedError" ? "The browser does not let the page use the camera: allow it in its settings." : error.message);
  });
}

function enter() {
  imagesBefore = rate_hz = 0;
  byId("welcome").hidden = true;
  document.documentElement.classList.toggle("xr", xr !== undefined);
  byId("hint").hidden = byId("bar").hidden = false;
  byId("record").hidden = !isLive || !walk || xr !== undefined; // an image without motion is no recording
}

function leave() {
  endCalibration(undefined);
  walk?.stop();
  const device = xr;
  xr = undefined;
  device?.stop();
  byId("welcome").hidden = false;
  document.documentElement.classList.remove("xr");
  byId("hint").hidden = byId("bar").hidden = true;
  stage.clear();
  showWelcome();
}

function showWelcome() {
  const code = codeIn(location.hash);
  if (code) byId<HTMLInputElement>("code").value = code;
  const known = membership && !code;
  byId("name_row").hidden = byId("code_row").hidden = known ?? false;
  byId("forget").hidden = !membership;
  byId("recalibrate").hidden = storedCalibrations() === 0;
  byId("invitation").textContent = known
    ? `You are ${membership!.name || `agent ${membership!.agent}`}${membership!.site ? ` at ${membership!.site}` : ""}.`
    : code ? "You are invited." : "With an invite code you join others. Without one, the phone tracks by itself.";
}

// --- what is shown

function onPose(pose: AgentPose) {
  const others = walk!.others.in(pose.map, performance.now());
  smallMap.draw(pose, walk!.camera.T_body_cam, walk!.anchors, others, colourOf, membership?.agent ?? 1);
}

// Whose maps are one with this one, as far as the agent is told: those who are there now first.
function together(): string[] {
  const { pose, anchors } = walk!;
  const present = pose ? walk!.others.in(pose.map, performance.now()).map(({ agent }) => agent) : [];
  const owner = pose?.fused && pose.group ? [Number(pose.group.split("/")[0])] : [];
  const others = new Set([...present, ...owner, ...anchors.map((anchor) => anchor.owner)]);
  others.delete(0);
  others.delete(membership?.agent ?? 0);
  return [...others].map((agent) => people.nameOf(agent));
}

let imagesBefore = 0;
let rate_hz = 0; // of images, smoothed

function showHint({ text, tone }: Hint) {
  byId("hint").textContent = text;
  byId("hint").className = tone;
}

function drawPanels() {
  if (calibration) {
    showHint(calibrationHint(calibration));
    showRing(calibration.progress.share);
    byId("numbers").textContent = `${Math.round(100 * calibration.progress.share)} % calibrated`;
  }
  if (!walk || byId("bar").hidden) return;
  showHint(hintOf({ ...walk, together: together() }));
  byId<HTMLMeterElement>("quality").value = walk.pose?.state === "tracking" ? walk.pose.numTracked : 0;
  rate_hz += 0.3 * (((walk.numImages - imagesBefore) * 1000) / kPanels_ms - rate_hz);
  imagesBefore = walk.numImages;
  byId("numbers").textContent = [
    `${rate_hz.toFixed(0)} Hz`,
    `${walk.pose?.numTracked ?? 0} features`,
    walk.numUnsent > 0 ? `${walk.numUnsent} unsent` : "",
    isLive ? (walk.recorder ? `${walk.recorder.numImages} recorded` : "") : `${(100 * played).toFixed(0)} %`,
  ].filter(Boolean).join(" · ");
}
setInterval(drawPanels, kPanels_ms);

let noticeTimer: ReturnType<typeof setTimeout> | undefined;

function notice(text: string) {
  byId("notice").textContent = text;
  clearTimeout(noticeTimer);
  noticeTimer = setTimeout(() => (byId("notice").textContent = ""), kNotice_ms);
}

// --- anchors

async function onTap(x: number, y: number) {
  if (!walk || !stage.drawn) return;
  const { utime, anchors } = stage.drawn;
  const tapped = anchors.find(({ pixel }) => {
    const [u, v] = stage.screenOf(walk!.camera, pixel);
    return Math.hypot(u - x, v - y) < kTapRadius;
  });
  if (tapped) return removeAnchor(tapped.id, tapped.name, tapped.owner);
  const pixel = stage.pixelAt(walk.camera, x, y);
  if (!pixel) return;
  const name = byId<HTMLInputElement>("anchor_name");
  name.value = "";
  if ((await askDialog("anchor_dialog")) === "place" && name.value.trim() !== "") {
    walk.placeAnchor(name.value.trim(), utime, pixel);
  }
}

async function removeAnchor(id: string, name: string, owner: number) {
  const isOwn = owner === membership?.agent;
  byId("remove_text").textContent = `${name}, placed by ${isOwn ? "you" : people.nameOf(owner)}.`;
  byId("remove_dialog").querySelector<HTMLElement>("[value=remove]")!.hidden = !isOwn;
  if ((await askDialog("remove_dialog")) === "remove") walk?.removeAnchor(id);
}

picture.addEventListener("click", ({ clientX, clientY }) => void onTap(clientX, clientY));

// --- buttons, drops, the tab

byId("join").addEventListener("submit", (event) => {
  event.preventDefault();
  attempt(startLive());
});
byId("stop").onclick = leave;
byId("forget").onclick = () => {
  forgetMembership();
  membership = undefined;
  showWelcome();
};
byId("recalibrate").onclick = () => {
  forgetCalibrations();
  showWelcome();
};
byId("record").onclick = async () => {
  if (!walk) return;
  const { recorder } = walk;
  if (!recorder) walk.startRecording();
  byId("record").textContent = recorder ? "Record" : "Save";
  byId("record").classList.toggle("recording", !recorder);
  if (!recorder) return;
  walk.recorder = undefined;
  await saveRecording(await recorder.finish(), recorder.name, membership, notice);
};
for (const what of ["folder", "zip"]) byId(`open_${what}`).onclick = () => byId(what).click();
byId<HTMLInputElement>("folder").onchange = ({ target }) => {
  const files = [...((target as HTMLInputElement).files ?? [])];
  if (files.length > 0) attempt(startRecorded(filesOf(new Map(files.map((file) => [file.webkitRelativePath, file])))));
};
byId<HTMLInputElement>("zip").onchange = ({ target }) => {
  const [file] = (target as HTMLInputElement).files ?? [];
  if (file) attempt(filesOfZip(file).then(startRecorded));
};
addEventListener("dragover", (event) => event.preventDefault());
addEventListener("drop", (event) => {
  event.preventDefault();
  if (event.dataTransfer) attempt(openDrop(event.dataTransfer.items));
});

async function openDrop(items: DataTransferItemList) {
  const dropped = await filesOfDrop(items);
  const [[name, blob]] = [...dropped, ["", undefined]] as [string, Blob | undefined][];
  if (dropped.size === 1 && blob && /\.ya?ml$/.test(name)) return keepCalibration(await blob.text());
  return startRecorded(dropped.size === 1 && blob ? await filesOfZip(blob) : filesOf(dropped));
}

// A sensor.yaml of this phone's camera, as pangea-calibrate writes it.
async function keepCalibration(yaml: string) {
  if (!camera) throw new Error("Start once, so that the camera is known; then drop its sensor.yaml again.");
  const { width, height } = parseCamera(yaml, "sensor.yaml");
  if (width !== camera.width || height !== camera.height) {
    throw new Error(`sensor.yaml: field 'resolution' is ${width} x ${height}, the camera gives ${camera.width} x ${camera.height}`);
  }
  storeCalibration(camera, yaml);
  notice("The calibration is kept for this camera.");
}

document.addEventListener("visibilitychange", () => {
  if (!walk || !isLive || byId("bar").hidden) return;
  if (document.hidden) walk.endMap();
  else void navigator.wakeLock?.request("screen").catch(() => {});
});
// Images stand otherwise in the device from now on: another camera, for the odometry.
screen.orientation?.addEventListener("change", () => {
  if (!isLive || xr || byId("bar").hidden) return;
  attempt(startLive());
});

showWelcome();

// For tests and the curious.
Object.assign(window, { pangea: { get walk() { return walk; }, get calibration() { return calibration; }, stage } });
