// Taps on the camera's image: a tap places an anchor, or opens the dialog of the anchor that it hits.

import { anchorName } from "../../../../web/page/anchor_name";
import { askDialog, byId } from "../dom";
import type { Stage } from "../view/stage";
import type { Walk } from "../walk";

const kTapRadius = 36; // CSS pixels around an anchor

// `current` returns the current walk, which may have changed when a dialog closes. `ownerName`: undefined for the visitor's own.
export async function onTap(
  x: number, y: number, current: () => Walk | undefined, stage: Stage, ownerName: (owner: number) => string | undefined,
) {
  const walk = current();
  if (!walk || !stage.drawn) return;
  const { utime, anchors } = stage.drawn;
  const tapped = anchors.find(({ pixel }) => {
    const [u, v] = stage.screenOf(walk.camera, pixel);
    return Math.hypot(u - x, v - y) < kTapRadius;
  });
  if (tapped) {
    if (await asksToRemove(tapped.name, ownerName(tapped.owner))) current()?.removeAnchor(tapped.id);
    return;
  }
  const pixel = stage.pixelAt(walk.camera, x, y);
  const name = pixel && (await askName());
  if (name) current()?.placeAnchor(name, utime, pixel);
}

async function askName(): Promise<string> {
  const field = byId<HTMLInputElement>("anchor_name");
  field.value = "";
  return (await askDialog("anchor_dialog")) === "place" ? anchorName(field.value) : "";
}

async function asksToRemove(name: string, owner: string | undefined): Promise<boolean> {
  byId("remove_text").textContent = `${name}, placed by ${owner ?? "you"}.`;
  byId("remove_dialog").querySelector<HTMLElement>("[value=remove]")!.hidden = owner !== undefined;
  return (await askDialog("remove_dialog")) === "remove";
}
