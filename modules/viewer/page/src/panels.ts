// The panels around the drawing: agents, state of processes, legend, player, tips.

import type { Model } from "./model";
import type { ConstraintSaid, ProcessSaid } from "./protocol";
import { agentColour, colours } from "../../../web/page/palette";

// A process or an agent that was silent for this time is marked. Processes publish their status once per second.
const kSilent_s = 3.5;
const kNamed = 5; // fused agents that are named on a card; more are only counted
const kFullCards = 6; // with more agents, cards are shorter, so that twelve have room

export function byId<T extends HTMLElement = HTMLElement>(id: string): T {
  return document.getElementById(id) as T;
}

// Makes an element; the text is never parsed as markup.
export function element(tag: string, className: string, text = ""): HTMLElement {
  const made = document.createElement(tag);
  made.className = className;
  made.textContent = text;
  return made;
}

// Gives `parent` one child for each key, in this order. Existing children stay, so that an element which people
// press or read is not replaced ten times per second.
export function keyed(parent: HTMLElement, keys: string[], make: (key: string) => HTMLElement): HTMLElement[] {
  const known = new Map([...parent.children].map((child) => [(child as HTMLElement).dataset.key, child]));
  const children = keys.map((key) => {
    const child = (known.get(key) as HTMLElement | undefined) ?? make(key);
    child.dataset.key = key;
    return child;
  });
  if (children.length !== parent.childElementCount || children.some((c, i) => parent.children[i] !== c)) {
    parent.replaceChildren(...children);
  }
  return children;
}

export function tell(at: HTMLElement, selector: string, text: string) {
  const told = at.querySelector(selector)!;
  if (told.textContent !== text) told.textContent = text;
}

export function metres(value: number): string {
  if (value < 0.01) return `${(1000 * value).toFixed(0)} mm`;
  return value < 1 ? `${(100 * value).toFixed(1)} cm` : `${value.toFixed(2)} m`;
}

export function clock(seconds: number): string {
  const whole = Math.floor(seconds);
  return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, "0")}`;
}

const milliseconds = (value: number) => (value < 10 ? value.toFixed(1) : value.toFixed(0));

// Half the length of the longer axis of the 95 % ellipse.
function radius95(covariance: [number, number, number, number]): number {
  const [xx, xy, yy] = covariance;
  const largest = (xx + yy) / 2 + Math.hypot((xx - yy) / 2, xy);
  return 2.4477 * Math.sqrt(largest);
}

function companyOf(fused: number[]): string {
  if (fused.length === 0) return "a map of its own";
  return fused.length > kNamed ? `one map with ${fused.length} others` : `one map with ${fused.join(", ")}`;
}

export function drawAgents(model: Model) {
  const keyframes = new Map<number, number>();
  for (const map of model.maps) {
    if (map) keyframes.set(map.said.agent, (keyframes.get(map.said.agent) ?? 0) + map.seqs.size);
  }
  const agents = [...model.agents.values()].sort((a, b) => a.id - b.id);
  const cards = keyed(byId("agents"), agents.map(({ id }) => String(id)), (id) => {
    const card = element("button", "agent");
    const what = element("span", "what");
    what.append(
      element("b", "", `Agent ${id}`), element("span", "state"), element("span", "fused"),
      element("span", "numbers seen"), element("span", "numbers drift"),
    );
    card.append(element("span", "badge", id), what);
    return card;
  });
  byId("agents").classList.toggle("many", agents.length > kFullCards);
  agents.forEach((agent, i) => {
    const card = cards[i];
    const fused = model.fusedWith(agent);
    const state = agent.state ?? "";
    (card.firstChild as HTMLElement).style.background = agentColour(agent.id);
    tell(card, ".state", state);
    card.querySelector(".state")!.classList.toggle("bad", state !== "" && state !== "tracking");
    const seen = `${keyframes.get(agent.id) ?? 0} keyframes` +
      (agent.num_tracked === undefined ? "" : ` · ${agent.num_tracked} tracks`);
    tell(card, ".fused", companyOf(fused));
    tell(card, ".seen", seen);
    tell(
      card, ".drift",
      `drift ${metres(agent.drift_m)}` +
        (agent.covariance_m2 ? ` · ± ${metres(radius95(agent.covariance_m2))}` : ""),
    );
    card.title =
      (agent.reason ? `${agent.reason}\n` : "") + `${companyOf(fused)}, ${seen}\n` +
      "Click: through its camera\ndrift: how far corrections have moved the agent since it joined its map; ±: longer half axis of the 95 % ellipse";
  });
}

export const isSilent = ({ heard_s }: ProcessSaid, now_s: number) => now_s - heard_s > kSilent_s;

function healthOf(process: ProcessSaid, now_s: number): { mark: string; state: string } {
  if (isSilent(process, now_s)) return { mark: "✕", state: "silent" };
  if (process.dropped > 0) return { mark: "▲", state: "losses" };
  return process.pending > 0 ? { mark: "◐", state: "busy" } : { mark: "●", state: "idle" };
}

// Number of messages and candidates that the process has refused.
const refusalsOf = (process: ProcessSaid) =>
  process.refused.reduce((sum, [, count]) => sum + count, 0);

export function drawHealth(model: Model) {
  const processes = [...model.processes.values()].sort((a, b) => a.name.localeCompare(b.name));
  const boxes = keyed(byId("health"), processes.map(({ name }) => name), () => {
    const box = element("div", "process");
    for (const part of ["name", "queue", "latency", "lost", "refused"]) {
      box.append(element(part === "name" ? "b" : "span", part));
    }
    return box;
  });
  processes.forEach((process, i) => {
    const box = boxes[i];
    const { mark, state } = healthOf(process, model.now_s);
    const latency = `${milliseconds(process.median_ms)} / ${milliseconds(process.p99_ms)} ms`;
    box.className = `process ${state}`;
    tell(box, ".name", `${mark} ${process.name}`);
    tell(box, ".queue", `queue ${process.pending}`);
    tell(box, ".latency", latency);
    tell(box, ".lost", `lost ${process.dropped}`);
    tell(box, ".refused", refusalsOf(process) > 0 ? `refused ${refusalsOf(process)}` : "");
    box.title = [
      `${process.name}: ${state}`,
      process.summary,
      `${process.in} messages in, ${process.out} out, ${process.dropped} dropped, ${process.resends_asked} asked for again`,
      `time per message, median and 99 %: ${latency}`,
      `${process.memory_mb.toFixed(0)} MB, ${process.cpu_s.toFixed(1)} s of CPU`,
      ...process.refused.map(([reason, count]) => `refused ${count}: ${reason}`),
    ].join("\n");
  });
}

export function drawLegend(gridCell_m: number, ellipseScale: number, leftOut: number) {
  const { accepted, refused } = colours();
  const legend = byId("legend");
  const told = [accepted, gridCell_m, ellipseScale, leftOut].join();
  if (legend.dataset.told === told) return;
  legend.dataset.told = told;
  const line = (colour: string, style: string, text: string) => {
    const entry = element("span", "entry");
    const sample = element("i", "sample");
    sample.style.borderTop = `2px ${style} ${colour}`;
    entry.append(sample, text);
    return entry;
  };
  legend.replaceChildren(
    line("currentColor", "solid", `grid ${gridCell_m} m`),
    line(accepted, "solid", "accepted constraint"),
    line(refused, "dashed", "refused"),
    ...(ellipseScale > 0 ? [element("span", "entry", `◯ 95 % ellipse of the position${ellipseScale > 1 ? `, × ${ellipseScale}` : ""}`)] : []),
    ...(leftOut > 0 ? [element("span", "entry", `${leftOut} items beyond what is shown`)] : []),
  );
}

export function tipOf(constraint: ConstraintSaid, model: Model): string {
  const end = ([map, seq]: [number, number]) =>
    `agent ${model.maps[map]?.said.agent ?? "?"}, keyframe ${seq}`;
  return [
    constraint.accepted ? "Accepted" : `Refused: ${constraint.reason || "no reason given"}`,
    constraint.from[0] === constraint.to[0] ? "within one map" : "between two maps",
    `${end(constraint.from)} ↔ ${end(constraint.to)}`,
    constraint.inliers > 0
      ? `${constraint.inliers} inliers (${(100 * constraint.inlier_ratio).toFixed(0)} %), ${constraint.rms_px.toFixed(2)} px rms`
      : "",
  ].filter(Boolean).join("\n");
}

export function drawMarks(model: Model) {
  const end = model.start?.end_s || 1;
  const marks = (model.start?.all_fusions ?? []).map((fusion) => {
    const mark = element("i", "mark");
    mark.style.left = `${(100 * fusion.time_s) / end}%`;
    mark.title = `${clock(fusion.time_s)}: ${fusionText(fusion)}`;
    return mark;
  });
  byId("marks").replaceChildren(...marks);
}

export function fusionText(fusion: { fused: boolean; agents: number[] }): string {
  const agents = fusion.agents.join(", ");
  return fusion.fused ? `one map now: agents ${agents}` : `taken apart: agents ${agents}`;
}
