// Connects the parts of the page: the visit, its display, and the visitor's taps, buttons and dropped files.

import "./style.css";
import { agentColour, colours } from "../../../web/page/palette";
import { byId } from "./dom";
import { AgentNames } from "./agent_names";
import { filesOf, filesOfDrop } from "./recording/files";
import type { Recorder } from "./recording/recorder";
import { saveRecording } from "./recording/save";
import { filesOfZip } from "./recording/zip";
import { onTap } from "./ui/anchor_taps";
import { clearNotice, notice } from "./ui/notice";
import { Panels } from "./ui/panels";
import { Welcome } from "./ui/welcome";
import { Stage } from "./view/stage";
import { Visit } from "./visit";

const options = new URLSearchParams(location.hash.slice(1));
const agentNames = new AgentNames();
const colourOf = (owner: number) => (owner > 0 ? agentColour(owner) : colours().anchor);
const picture = byId<HTMLCanvasElement>("picture");
const stage = new Stage(picture, byId<HTMLCanvasElement>("overlay"), byId("labels"), (agent) => agentNames.nameOf(agent), colourOf);
const welcome = new Welcome();
const self = () => welcome.membership?.agent ?? 0;
const visit = new Visit(
  stage,
  () => welcome.admit(),
  { onEnter, onLeave, onPose: (pose) => panels.drawMap(pose), onRecorded, onNotice: notice },
  { ownOdometry: options.get("odometry") === "own", realTime: options.get("rate") !== "max" },
);
const panels = new Panels(visit, agentNames, self, colourOf);

function onEnter() {
  welcome.hide();
  panels.show();
}

function onLeave() {
  panels.hide();
  welcome.isRefused = visit.walk?.link === "refused";
  welcome.show();
}

let numUnsaved = 0; // finished recordings

function onRecorded(recorder: Recorder) {
  panels.showRecording();
  ++numUnsaved;
  const saved = recorder.finish().then((zip) => saveRecording(zip, recorder.name, welcome.membership, notice));
  attempt(saved.finally(() => --numUnsaved));
}

// Tells the visitor why it failed.
function attempt(what: Promise<void>): Promise<void> {
  clearNotice();
  return what.catch(({ message }: Error) => notice(message));
}

// --- buttons and taps

byId("join").addEventListener("submit", (event) => {
  event.preventDefault();
  const start = byId<HTMLButtonElement>("start");
  start.disabled = true;
  void attempt(visit.startLive()).finally(() => (start.disabled = false));
});
byId("stop").onclick = () => visit.leave();
byId("record").onclick = () => {
  if (visit.walk?.recorder) return visit.finishRecording();
  visit.walk?.startRecording();
  panels.showRecording();
};
picture.addEventListener("click", ({ clientX, clientY }) => {
  const ownerName = (owner: number) => (owner === self() ? undefined : agentNames.nameOf(owner));
  void onTap(clientX, clientY, () => visit.walk, stage, ownerName);
});

// --- recordings, and calibrations of this phone's camera

for (const what of ["folder", "zip"]) byId(`open_${what}`).onclick = () => byId(what).click();
// The files that were chosen. The field is emptied, so that the same ones can be chosen again.
function chosen(field: HTMLInputElement): File[] {
  const files = [...(field.files ?? [])];
  field.value = "";
  return files;
}
byId<HTMLInputElement>("folder").onchange = ({ target }) => {
  const files = chosen(target as HTMLInputElement);
  const byPath = new Map(files.map((file) => [file.webkitRelativePath, file]));
  if (files.length > 0) attempt(visit.startRecorded(filesOf(byPath)));
};
byId<HTMLInputElement>("zip").onchange = ({ target }) => {
  const [file] = chosen(target as HTMLInputElement);
  if (file) attempt(filesOfZip(file).then((files) => visit.startRecorded(files)));
};
addEventListener("dragover", (event) => event.preventDefault());
addEventListener("drop", (event) => {
  event.preventDefault();
  if (event.dataTransfer) attempt(openDrop(event.dataTransfer.items));
});

async function openDrop(items: DataTransferItemList) {
  const dropped = await filesOfDrop(items);
  const [[name, blob]] = [...dropped, ["", undefined]] as [string, Blob | undefined][];
  if (dropped.size === 1 && blob && /\.ya?ml$/.test(name)) {
    visit.keepCalibration(await blob.text());
    notice("The calibration is kept for this camera.");
    return;
  }
  await visit.startRecorded(dropped.size === 1 && blob ? await filesOfZip(blob) : filesOf(dropped));
}

// --- the tab and the screen

// The browser asks before it leaves the page, which would lose a recording.
addEventListener("beforeunload", (event) => {
  if (visit.walk?.recorder || numUnsaved > 0) event.preventDefault();
});
// A link with a code or an option that is opened in this tab: the browser does not load the page again.
addEventListener("hashchange", () => panels.shown || location.reload());
document.addEventListener("visibilitychange", () => {
  if (panels.shown) visit.onVisibility(document.hidden);
});
// A rotated screen rotates the images in the device; for the odometry this is another camera.
screen.orientation?.addEventListener("change", () => {
  if (visit.isLive && !visit.usesXr && panels.shown) attempt(visit.startLive());
});

// For tests and debugging.
Object.assign(window, { pangea: { get walk() { return visit.walk; }, get calibration() { return visit.calibration; }, stage } });
