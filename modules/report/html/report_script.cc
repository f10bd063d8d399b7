#include "report/html/report_svg.h"

namespace pangea {

// CDATA, because tests parse the page as XML.
const char* const kChartScript = R"js(//<![CDATA[
"use strict";

const kReach = 20; // how far from a line the pointer may be, in units of the drawing

function axisOf(svg, which) {
  const [low, high, from, to] = svg.dataset[which].split(" ").map(Number);
  const label = svg.dataset[which + "Label"];
  const unit = /\[([^\s\]]*)/.exec(label)?.[1] ?? label; // of "CPU [% of one core]": "%"
  const decimals = Math.max(0, 3 - Math.ceil(Math.log10(high - low)));
  const value = (at) => low + ((at - from) / (to - from)) * (high - low);
  return { from, to, text: (at) => `${value(at).toFixed(decimals)} ${unit}`.trim() };
}

// Where the segment from a to b is nearest to p.
function nearestOf(a, b, p) {
  const dx = b.x - a.x, dy = b.y - a.y;
  const along = ((p.x - a.x) * dx + (p.y - a.y) * dy) / (dx * dx + dy * dy || 1);
  const t = Math.min(1, Math.max(0, along));
  const x = a.x + t * dx, y = a.y + t * dy;
  return { x, y, distance: Math.hypot(x - p.x, y - p.y) };
}

const nearer = (a, b) => (b.distance < a.distance ? b : a);
const kNowhere = { distance: Infinity };

class Line {
  #runs;
  constructor(group) {
    this.group = group;
    this.name = group.dataset.name;
  }
  get shown() {
    return this.name !== "" && !this.group.classList.contains("off");
  }
  get runs() {
    this.#runs ??= [...this.group.querySelectorAll("polyline")].map((p) => Array.from(p.points, ({ x, y }) => ({ x, y })));
    return this.#runs;
  }
  nearestTo(p) {
    let best = kNowhere;
    for (const run of this.runs) {
      run.forEach((b, i) => (best = nearer(best, nearestOf(run[Math.max(0, i - 1)], b, p))));
    }
    return { line: this, ...best };
  }
  // Where it is drawn at this x; none where it has a gap, or is over.
  at(x) {
    for (const run of this.runs) {
      const next = run.findIndex((p) => p.x >= x);
      if (next > 0) {
        const a = run[next - 1], b = run[next];
        return { line: this, x, y: a.y + ((x - a.x) / (b.x - a.x)) * (b.y - a.y) };
      }
    }
    return undefined;
  }
}

function element(parent, name, attributes) {
  const made = document.createElementNS(parent.namespaceURI, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  return parent.appendChild(made);
}

class Chart {
  constructor(figure) {
    this.figure = figure;
    this.svg = figure.querySelector("svg");
    this.tip = figure.querySelector(".tip");
    this.x = axisOf(this.svg, "x");
    this.y = axisOf(this.svg, "y");
    this.lines = [...this.svg.querySelectorAll(".line")].map((group) => new Line(group));
    this.marks = element(this.svg, "g", { class: "marks" });
    this.svg.addEventListener("pointermove", (event) => this.ask(event));
    this.svg.addEventListener("pointerdown", (event) => this.ask(event));
    this.svg.addEventListener("pointerleave", () => this.clear());
    for (const button of figure.querySelectorAll(".legend button")) {
      button.addEventListener("click", () => this.toggle(button));
    }
  }

  toggle(button) {
    const on = button.getAttribute("aria-pressed") !== "true";
    button.setAttribute("aria-pressed", String(on));
    for (const { name, group } of this.lines) {
      if (name === button.dataset.name) group.classList.toggle("off", !on);
    }
    this.clear();
  }

  ask(event) {
    this.clear();
    const p = new DOMPoint(event.clientX, event.clientY).matrixTransform(this.svg.getScreenCTM().inverse());
    const shown = this.lines.filter((line) => line.shown);
    let found;
    if (this.svg.dataset.pick === "x") {
      found = shown.map((line) => line.at(p.x)).filter((at) => at !== undefined);
    } else {
      const best = shown.map((line) => line.nearestTo(p)).reduce(nearer, kNowhere);
      found = best.distance < kReach ? [best] : [];
    }
    if (found.length > 0) this.show(found, event);
  }

  show(found, event) {
    const { x } = found[0];
    if (this.svg.dataset.pick === "x") {
      element(this.marks, "path", { class: "rule", d: `M${x} ${this.y.from}V${this.y.to}` });
    }
    this.row("", this.x.text(x), "");
    for (const { line, x: cx, y: cy } of found) {
      const colour = line.group.getAttribute("style");
      element(this.marks, "circle", { cx, cy, r: 4, style: colour });
      this.row(line.name, this.svg.dataset.yLabel === "" ? "" : this.y.text(cy), colour);
    }
    this.tip.hidden = false;
    const box = this.figure.getBoundingClientRect();
    const left = event.clientX - box.left, top = event.clientY - box.top;
    const { offsetWidth, offsetHeight } = this.tip;
    this.tip.style.left = `${left + 16 + offsetWidth < box.width ? left + 16 : Math.max(0, left - 16 - offsetWidth)}px`;
    this.tip.style.top = `${Math.max(0, Math.min(top + 16, box.height - offsetHeight))}px`;
  }

  row(name, value, colour) {
    const row = element(this.tip, "span", { class: "row", style: colour });
    element(row, "i", {}).textContent = name;
    element(row, "b", {}).textContent = value;
  }

  clear() {
    this.tip.hidden = true;
    this.tip.replaceChildren();
    this.marks.replaceChildren();
  }
}

for (const figure of document.querySelectorAll(".chart")) new Chart(figure);
//]]>)js";

}  // namespace pangea
