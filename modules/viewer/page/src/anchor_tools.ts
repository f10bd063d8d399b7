// The tools for anchors: the list, placing, dragging, deleting. The page asks the server for a change, and shows
// what the server answers.

import { Vector3 } from "three";
import { anchorName } from "../../../web/page/anchor_name";
import type { Connection } from "./connection";
import type { Model } from "./model";
import { byId, element, keyed, metres, tell } from "./panels";
import type { AnchorSaid, Said } from "./protocol";
import type { Stage } from "./stage";

const kMaxListed = 200;
const kClickPixels = 4; // a shorter movement of the pointer is a click and not a drag
const kSure_ms = 3000; // time in which delete must be pressed again

export const madeBy = ({ id }: AnchorSaid) => (id[0] === 0 ? "a tool on the server" : `agent ${id[0]}`);

export class AnchorTools {
  private placing = false;
  private down?: { x: number; y: number };
  private drag?: { index: number; from: Vector3; moved: boolean };
  private told = "";

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly stage: Stage,
    private readonly model: Model,
    private readonly connection: Connection,
    private readonly announce: (text: string) => void,
  ) {
    byId("anchor_add").onclick = () => this.place(!this.placing);
    byId("anchors").onclick = ({ target }) => this.pressed(target as HTMLElement);
    // Capturing: called before the controls of the camera.
    canvas.addEventListener("pointerdown", (event) => this.pointerDown(event), { capture: true });
    canvas.addEventListener("pointermove", (event) => this.pointerMove(event));
    canvas.addEventListener("pointerup", (event) => this.pointerUp(event));
    canvas.addEventListener("pointercancel", () => this.cancelDrag());
    addEventListener("keydown", ({ key }) => {
      if (key !== "Escape") return;
      this.place(false);
      this.cancelDrag();
    });
  }

  // --- the list

  draw() {
    byId("anchor_add").hidden = !this.editable;
    const anchors = [...this.model.anchors.values()].map(({ said }) => said);
    const told = JSON.stringify([anchors.length, this.stage.chosenAnchor, this.model.anchorsVersion]);
    if (told === this.told) return;
    this.told = told;
    anchors.sort((a, b) => a.name.localeCompare(b.name) || a.index - b.index);
    const rest = anchors.length - kMaxListed;
    byId("anchors").hidden = anchors.length === 0;
    const listed = anchors.slice(0, kMaxListed);
    const keys = listed.map(({ index }) => String(index));
    const rows = keyed(byId("anchors"), rest > 0 ? [...keys, "rest"] : keys, (key) =>
      key === "rest" ? element("div", "numbers") : makeRow());
    listed.forEach((said, i) => this.fill(rows[i], said));
    if (rest > 0) rows[kMaxListed].textContent = `… and ${rest} more`;
  }

  private fill(row: HTMLElement, said: AnchorSaid) {
    tell(row, ".name", said.name || "(no name)");
    tell(row, ".numbers", `${madeBy(said)} · σ ${metres(said.sigma_m)}`);
    row.classList.toggle("chosen", said.index === this.stage.chosenAnchor);
    row.querySelector<HTMLElement>(".delete")!.hidden = !this.editable;
    row.title = `${said.name}\nid ${said.id.join("/")}, revision ${said.revision}\n` +
      `made by ${madeBy(said)}, payload ${said.payload_bytes} bytes\nClick: fly to it`;
  }

  private pressed(target: HTMLElement) {
    const row = target.closest<HTMLElement>(".anchor");
    const anchor = row && this.model.anchors.get(Number(row.dataset.key));
    if (!anchor) return;
    if (target.matches(".delete")) {
      this.delete(target, anchor.said);
    } else {
      this.stage.flyTo(anchor.said.index);
      this.draw();
    }
  }

  // Deleting cannot be undone, so the button must be pressed twice.
  private delete(button: HTMLElement, said: AnchorSaid) {
    if (button.dataset.sure) {
      this.ask({ anchor_delete: { anchor: said.id } });
      return;
    }
    button.dataset.sure = "yes";
    button.textContent = "delete?";
    setTimeout(() => {
      delete button.dataset.sure;
      button.textContent = "✕";
    }, kSure_ms);
  }

  // --- on the stage

  private get editable(): boolean {
    return this.model.start?.editable ?? false;
  }

  private place(placing: boolean) {
    this.placing = placing;
    byId("anchor_add").classList.toggle("chosen", placing);
    this.canvas.style.cursor = placing ? "crosshair" : "";
    if (placing) this.announce("Click a map point or a keyframe");
  }

  private pointerDown({ offsetX, offsetY, button, pointerId }: PointerEvent) {
    this.down = button === 0 ? { x: offsetX, y: offsetY } : undefined;
    const index = button === 0 && !this.placing ? this.stage.picking.anchorAt(offsetX, offsetY) : undefined;
    if (index === undefined || !this.editable) return;
    this.drag = { index, from: this.model.anchorPose(index)!.t, moved: false };
    this.stage.holdCamera(true);
    this.canvas.setPointerCapture(pointerId);
  }

  // Drags in the plane that faces the camera; with Shift, along the ground.
  private pointerMove({ offsetX, offsetY, shiftKey }: PointerEvent) {
    if (!this.drag || !this.down) return;
    this.drag.moved ||= Math.hypot(offsetX - this.down.x, offsetY - this.down.y) > kClickPixels;
    if (!this.drag.moved) return;
    const normal = shiftKey ? new Vector3(0, 0, 1) : this.stage.viewDirection();
    const at = this.stage.picking.onPlane(offsetX, offsetY, this.drag.from, normal);
    if (at) this.model.moveAnchor(this.drag.index, at);
    this.stage.redraw();
  }

  private pointerUp({ offsetX, offsetY }: PointerEvent) {
    const clicked = this.down && Math.hypot(offsetX - this.down.x, offsetY - this.down.y) <= kClickPixels;
    const { drag } = this;
    this.endDrag();
    if (drag?.moved) {
      this.sayMoved(drag.index);
    } else if (clicked && this.placing) {
      void this.placeAt(offsetX, offsetY);
    } else if (clicked) {
      this.stage.choose(this.stage.picking.anchorAt(offsetX, offsetY));
      this.draw();
    }
  }

  // Asks the server for a change.
  private ask(change: Said) {
    if (!this.connection.say(change)) this.announce("Not connected: nothing was changed");
  }

  // The anchor goes back to where the server has it.
  private cancelDrag() {
    if (this.drag) this.model.putBack(this.drag.index);
    this.endDrag();
    this.stage.redraw();
  }

  private endDrag() {
    this.down = this.drag = undefined;
    this.stage.holdCamera(false);
  }

  private sayMoved(index: number) {
    const anchor = this.model.anchors.get(index);
    if (!anchor?.moved) return; // it was deleted or changed meanwhile
    const { t } = anchor.moved.T_holder_anchor;
    this.ask({ anchor_move: { anchor: anchor.said.id, keyframe: anchor.holder, p_body: [t.x, t.y, t.z] } });
  }

  private async placeAt(x: number, y: number) {
    const place = this.stage.picking.pick(x, y);
    if (!place) {
      this.announce("No map point there");
      return;
    }
    this.place(false);
    const name = anchorName((await askName()) ?? "");
    if (!name) return;
    this.ask({
      anchor_add: { name, keyframe: place.keyframe, p_body: [place.p_body.x, place.p_body.y, place.p_body.z] },
    });
  }
}

function makeRow(): HTMLElement {
  const row = element("div", "anchor");
  const what = element("button", "what");
  what.append(element("b", "name"), element("span", "numbers"));
  const remove = element("button", "delete", "✕");
  remove.ariaLabel = "Delete";
  row.append(what, remove);
  return row;
}

// Asks for a name; undefined if cancelled.
function askName(): Promise<string | undefined> {
  const dialog = byId<HTMLDialogElement>("anchor_dialog");
  const input = byId<HTMLInputElement>("anchor_name");
  input.value = "";
  dialog.returnValue = "";
  dialog.showModal();
  return new Promise((done) => {
    dialog.onclose = () => done(dialog.returnValue === "place" ? input.value : undefined);
  });
}
