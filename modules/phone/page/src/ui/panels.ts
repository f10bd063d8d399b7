// The panels over the camera's image: the hint, the calibration's ring, tracking quality and numbers, the small map.

import type { PhonePose } from "../agent/phone_agent";
import { byId } from "../dom";
import type { AgentNames } from "../agent_names";
import type { Visit } from "../visit";
import { calibrationHint, hintOf } from "./hints";
import type { Hint } from "./hints";
import { showRing } from "./ring";
import { SmallMap } from "./small_map";

const kInterval_ms = 250;

export class Panels {
  private readonly map = new SmallMap(byId<HTMLCanvasElement>("map"));
  private imagesBefore = 0;
  private rate_hz = 0; // of images, smoothed

  // `self`: this phone's agent, 0 without one.
  constructor(
    private readonly visit: Visit,
    private readonly agentNames: AgentNames,
    private readonly self: () => number,
    private readonly colourOf: (owner: number) => string,
  ) {
    byId("skip").onclick = () => visit.skipCalibration?.();
    setInterval(() => this.draw(), kInterval_ms);
  }

  get shown(): boolean {
    return !byId("bar").hidden;
  }

  show() {
    const { walk, calibration, isLive, usesXr, skipCalibration } = this.visit;
    showRing(calibration?.progress.share);
    this.imagesBefore = this.rate_hz = 0;
    document.documentElement.classList.toggle("xr", usesXr);
    byId("hint").hidden = byId("bar").hidden = false;
    this.showRecording();
    byId("record").hidden = !isLive || !walk || usesXr; // images without motion data are not a recording
    byId("skip").hidden = skipCalibration === undefined;
    if (usesXr && !walk) this.showHint({ text: "Move the phone slowly, so that AR finds its way.", tone: "do" });
  }

  hide() {
    document.documentElement.classList.remove("xr");
    showRing(undefined);
    byId("hint").hidden = byId("bar").hidden = true;
  }

  // What the button does next, and whether a recording runs.
  showRecording() {
    const isRecording = this.visit.walk?.recorder !== undefined;
    byId("record").textContent = isRecording ? "Save" : "Record";
    byId("record").classList.toggle("recording", isRecording);
  }

  drawMap(pose: PhonePose) {
    const walk = this.visit.walk!;
    const others = walk.others.in(pose.map, performance.now());
    this.map.draw(pose, walk.camera.T_body_cam, walk.anchors, others, this.colourOf, this.self() || 1);
  }

  private draw() {
    const { calibration, walk } = this.visit;
    if (calibration) {
      showRing(calibration.progress.share);
      this.showHint(calibrationHint(calibration));
      byId("numbers").textContent = `${Math.round(100 * calibration.progress.share)} % calibrated`;
    }
    if (!walk || !this.shown) return;
    this.showHint(hintOf({ ...walk, cameraSilent: walk.cameraSilent, together: this.together() }));
    byId<HTMLMeterElement>("quality").value = walk.pose?.state === "tracking" ? walk.pose.numTracked : 0;
    this.rate_hz += 0.3 * (((walk.numImages - this.imagesBefore) * 1000) / kInterval_ms - this.rate_hz);
    this.imagesBefore = walk.numImages;
    byId("numbers").textContent = this.numbers();
  }

  private numbers(): string {
    const { walk, isLive, playedShare } = this.visit;
    return [
      `${this.rate_hz.toFixed(0)} Hz`,
      `${walk!.pose?.numTracked ?? 0} features`,
      walk!.numUnsent > 0 ? `${walk!.numUnsent} unsent` : "",
      isLive ? (walk!.recorder ? `${walk!.recorder.numImages} recorded` : "") : `${(100 * playedShare).toFixed(0)} %`,
    ].filter(Boolean).join(" · ");
  }

  // Screen readers read a text again whenever it is set.
  private showHint({ text, tone }: Hint) {
    if (byId("hint").textContent !== text) byId("hint").textContent = text;
    byId("hint").className = tone;
  }

  // The people whose maps are fused with this one, as far as the agent knows; those who are present come first.
  private together(): string[] {
    const { pose, anchors, others } = this.visit.walk!;
    const present = pose ? others.in(pose.map, performance.now()).map(({ agent }) => agent) : [];
    const owner = pose?.fused && pose.group ? [Number(pose.group.split("/")[0])] : [];
    const agents = new Set([...present, ...owner, ...anchors.map((anchor) => anchor.owner)]);
    agents.delete(0);
    agents.delete(this.self());
    return [...agents].map((agent) => this.agentNames.nameOf(agent));
  }
}
