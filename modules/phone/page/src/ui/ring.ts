// The ring that fills while a camera is calibrated.

import { byId } from "../dom";

export function showRing(share: number | undefined) {
  byId("calibration").hidden = share === undefined;
  const percent = Math.round(100 * (share ?? 0));
  byId("ring").style.setProperty("--share", `${percent}%`);
  byId("ring").setAttribute("aria-valuenow", String(percent));
}
