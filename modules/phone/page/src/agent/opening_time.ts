// When an agent opens its first map: the map's id. The server takes the map with the latest time for the one in which the agent is, so it
// must be later than those of earlier runs, also on a phone whose clock was set back.

import { store, stored } from "../storage";

const kKey = "pangea.opened_utime"; // of the newest run
const kBetween_us = 1_000_000; // each further map of a run is opened one microsecond later

export function openingTime(now_us: number): number {
  const last = Number(stored(kKey));
  const opened = Number.isSafeInteger(last) ? Math.max(now_us, last + kBetween_us) : now_us;
  store(kKey, String(opened));
  return opened;
}
