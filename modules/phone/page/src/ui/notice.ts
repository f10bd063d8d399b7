// Shows for a few seconds what went wrong or was done.

import { byId } from "../dom";

const kShown_ms = 6000;
let timer: ReturnType<typeof setTimeout> | undefined;

export function notice(text: string) {
  byId("notice").textContent = text;
  clearTimeout(timer);
  timer = setTimeout(clearNotice, kShown_ms);
}

export function clearNotice() {
  byId("notice").textContent = "";
}
