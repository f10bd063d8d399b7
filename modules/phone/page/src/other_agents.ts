// The poses at which the other people of the group are shown. Each moves from its shown pose to the newest one from the server.

import { Quaternion, Vector3 } from "three";
import type { OtherAgent, Others, Pose7 } from "./agent/phone_agent";

const kWay_ms = 250; // a little longer than the server's interval
const kKept_ms = 2000;
const kLongestWay_m = 2; // a longer way is a correction and not walking: it is jumped

interface Known {
  from: Pose7;
  to: Pose7;
  told_ms: number;
}

export class OtherAgents {
  private map = "";
  private readonly known = new Map<number, Known>();

  take({ map, others }: Others, now_ms: number) {
    if (map !== this.map) this.known.clear();
    this.map = map;
    for (const { agent, T_odom_cam: to } of others) {
      const known = this.known.get(agent);
      const from = known && isFresh(known, now_ms) && distance(known.to, to) < kLongestWay_m ? between(known, now_ms) : to;
      this.known.set(agent, { from, to, told_ms: now_ms });
    }
  }

  // The others in the odom frame of `map`; none if the server's poses are for another map.
  in(map: string, now_ms: number): OtherAgent[] {
    if (map !== this.map) return [];
    return [...this.known].filter(([, known]) => isFresh(known, now_ms))
      .map(([agent, known]) => ({ agent, T_odom_cam: between(known, now_ms) }));
  }
}

const isFresh = ({ told_ms }: Known, now_ms: number) => now_ms - told_ms < kKept_ms;

const distance = ([ax, ay, az]: Pose7, [bx, by, bz]: Pose7) => Math.hypot(ax - bx, ay - by, az - bz);

function between({ from, to, told_ms }: Known, now_ms: number): Pose7 {
  const share = Math.min(1, (now_ms - told_ms) / kWay_ms);
  const p = new Vector3(from[0], from[1], from[2]).lerp(new Vector3(to[0], to[1], to[2]), share);
  const q = new Quaternion(from[3], from[4], from[5], from[6]).slerp(new Quaternion(to[3], to[4], to[5], to[6]), share);
  return [p.x, p.y, p.z, q.x, q.y, q.z, q.w];
}
