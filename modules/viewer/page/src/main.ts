import "./style.css";
import { AnchorTools, madeBy } from "./anchor_tools";
import { Connection } from "./connection";
import { Model } from "./model";
import {
  byId, clock, drawAgents, drawHealth, drawLegend, drawMarks, fusionText, tipOf,
} from "./panels";
import { drawPhones } from "./phones";
import { onThemeChange } from "../../../web/page/palette";
import type { Update } from "./protocol";
import { Stage } from "./stage";
import { drawView } from "./view";

const kNotice_ms = 5000;

const model = new Model();
const canvas = byId<HTMLCanvasElement>("stage");
const stage = new Stage(canvas, byId("labels"), model);
let panelsDirty = true;
let speed = NaN; // of the player, as the server has last said; another page may have set it
let dragging = false;

let watched = 0; // the agent whose camera is shown

const connection = new Connection(take, (open) => {
  if (open && watched > 0) connection.say({ watch: watched });
  byId("connection").textContent = open ? "" : "not connected, trying again…";
});

const anchorTools = new AnchorTools(canvas, stage, model, connection, announce);

function take(update: Update) {
  model.apply(update);
  stage.take(update);
  if (update.start) {
    drawMarks(model);
    byId("notice").classList.remove("shown");
  }
  if (update.view?.agent === watched) void drawView(update.view);
  for (const fusion of update.fusions) {
    // Fusions from before the page was opened, or that were jumped over, are not announced.
    if (!update.start && model.now_s - fusion.time_s < 3) announce(fusionText(fusion));
  }
  const { notice } = update;
  if (notice && model.now_s - notice.time_s < 3) announce(notice.text);
  panelsDirty = true;
}

let hiding: ReturnType<typeof setTimeout> | undefined;

function announce(text: string) {
  const notice = byId("notice");
  notice.textContent = text;
  notice.classList.add("shown");
  clearTimeout(hiding);
  hiding = setTimeout(() => notice.classList.remove("shown"), kNotice_ms);
}

function drawPanels() {
  const { start } = model;
  if (!start) return;
  byId("source").textContent = start.live ? `live · ${start.source}` : start.source;
  byId("empty").textContent =
    model.agents.size > 0 ? "" : start.live ? `Waiting for agents on ${start.source}` : "Nothing yet: play on";
  byId("player").hidden = start.live;
  byId("play").textContent = model.playing ? "❚❚" : "▶";
  if (model.speed !== speed) byId<HTMLSelectElement>("speed").value = String((speed = model.speed));
  byId("time").textContent = `${clock(model.now_s)} / ${clock(start.end_s)}`;
  const slider = byId<HTMLInputElement>("slider");
  slider.max = String(start.end_s);
  if (!dragging) slider.value = String(model.now_s);
  drawAgents(model);
  anchorTools.draw();
  drawHealth(model);
  drawPhones(model);
  drawLegend(stage.gridCell_m, stage.ellipseScale, model.leftOut);
}

// --- controls

for (const what of ["points", "accepted", "refused", "anchors"] as const) {
  const box = byId<HTMLInputElement>(`show_${what}`);
  box.onchange = () => stage.show(what, box.checked);
}
byId<HTMLSelectElement>("ellipses").onchange = ({ target }) => {
  stage.ellipseScale = Number((target as HTMLSelectElement).value);
  stage.redraw();
  panelsDirty = true;
};
byId("agents").onclick = ({ target }) => {
  const card = (target as HTMLElement).closest<HTMLElement>(".agent");
  if (!card) return;
  const agent = Number(card.dataset.key);
  watched = agent === watched ? 0 : agent;
  byId("view").hidden = true;
  connection.say({ watch: watched });
};
byId("view_close").onclick = () => {
  watched = 0;
  byId("view").hidden = true;
  connection.say({ watch: 0 });
};
byId("fit").onclick = () => stage.fit();
for (const which of ["before", "after"] as const) {
  byId(which).onclick = () => {
    model.before = which === "before";
    byId("before").classList.toggle("chosen", model.before);
    byId("after").classList.toggle("chosen", !model.before);
    model.place();
    stage.fit();
  };
}
byId("play").onclick = () => connection.say({ play: !model.playing });
byId<HTMLSelectElement>("speed").onchange = ({ target }) =>
  connection.say({ speed: Number((target as HTMLSelectElement).value) });
const slider = byId<HTMLInputElement>("slider");
slider.oninput = () => {
  dragging = true;
  connection.say({ seek: Number(slider.value) });
};
slider.onchange = slider.onpointercancel = () => (dragging = false);
addEventListener("keydown", ({ key, target }) => {
  if (key === " " && (target === canvas || target === document.body)) byId("play").click();
});

function hover(x: number, y: number) {
  const box = canvas.getBoundingClientRect();
  const anchor = model.anchors.get(stage.picking.anchorAt(x - box.left, y - box.top) ?? -1);
  const constraint = anchor ? undefined : stage.picking.constraintAt(x - box.left, y - box.top);
  stage.highlight(constraint);
  const tip = byId("tip");
  tip.textContent = anchor
    ? `${anchor.said.name}\nanchor by ${madeBy(anchor.said)}`
    : constraint ? tipOf(constraint, model) : "";
  tip.style.left = `${Math.min(x + 14, innerWidth - 300)}px`;
  tip.style.top = `${y + 14}px`;
}
canvas.addEventListener("pointermove", ({ clientX, clientY, buttons }) => {
  if (buttons === 0) hover(clientX, clientY);
});
canvas.addEventListener("click", ({ clientX, clientY }) => hover(clientX, clientY));
onThemeChange(() => stage.recolour());

// --- frames

let frames = 0;
let measuring = false;
let secondBegan = performance.now();
let bytesBefore = 0;

function showMetrics(now: number) {
  const seconds = (now - secondBegan) / 1000;
  if (seconds < 1) return;
  const rate = (connection.bytes - bytesBefore) / 1000 / seconds;
  byId("metrics").textContent =
    `${model.numPoints.toLocaleString("en")} points · ${rate.toFixed(rate < 10 ? 1 : 0)} kB/s`;
  secondBegan = now;
  bytesBefore = connection.bytes;
}

function frame(now: number) {
  if (panelsDirty) {
    panelsDirty = false;
    drawPanels();
  }
  if (stage.frame(now, measuring)) ++frames;
  showMetrics(now);
  requestAnimationFrame(frame);
}
requestAnimationFrame(frame);

// For tests and debugging: the page's data, and how fast it draws.
Object.assign(window, {
  pangea: {
    model,
    stage,
    drawView,
    received: () => connection.bytes,
    // Draws every frame for some seconds, even if nothing moves.
    async framesPerSecond(seconds: number): Promise<number> {
      measuring = true;
      const before = frames;
      const began = performance.now();
      await new Promise((done) => setTimeout(done, 1000 * seconds));
      measuring = false;
      return (frames - before) / ((performance.now() - began) / 1000);
    },
  },
});
