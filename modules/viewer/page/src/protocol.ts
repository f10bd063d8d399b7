// The messages of the WebSocket. The server's side, with the layout of the bytes, is modules/viewer/scene/update.h.

// x y z, qw qx qy qz.
export type PoseNumbers = ArrayLike<number>;

export interface MapSaid {
  index: number;
  agent: number;
  name: string;
  group: number;
  T_map_odom: PoseNumbers;
}

export interface AgentSaid {
  id: number;
  map: number; // -1: none yet
  heard_s: number;
  T_odom_body: PoseNumbers;
  T_body_cam: PoseNumbers;
  view: [number, number, number, number]; // left, top, right, bottom at z = 1
  drift_m: number;
  state?: string;
  reason?: string;
  num_tracked?: number;
  covariance_m2?: [number, number, number, number]; // xx, xy, yy, zz
}

export interface ConstraintSaid {
  index: number;
  from: [number, number]; // map, seq
  to: [number, number];
  inter: boolean;
  accepted: boolean;
  reason: string;
  inliers: number;
  inlier_ratio: number;
  rms_px: number;
}

export interface ProcessSaid {
  name: string;
  heard_s: number;
  summary: string;
  pending: number;
  in: number;
  out: number;
  dropped: number;
  resends_asked: number;
  median_ms: number;
  p99_ms: number;
  memory_mb: number;
  cpu_s: number;
  refused: [string, number][];
}

export interface FusionSaid {
  time_s: number;
  fused: boolean;
  agents: number[];
}

interface KeyframeSaid {
  index: number;
  map: number;
  seq: number;
  T_odom_body: Float32Array;
  points: Float32Array; // x y z in the body frame, one after the other
}

interface SolvedSaid {
  index: number;
  group: number;
  T_map_body: Float32Array;
}

export interface ViewSaid {
  agent: number;
  width: number;
  height: number;
  encoding: number; // image_t.ENCODING_*; 0: no image
  tracks: Float32Array[]; // u v, newest first
  image: Uint8Array;
}

// An anchor in its group's frame, z up. A gone anchor has only index, id and gone.
export interface AnchorSaid {
  index: number;
  id: [number, number]; // agent that made it (0: a tool on the server), and created_utime
  gone: boolean;
  name: string;
  revision: number;
  edited_by: number;
  payload_bytes: number;
  group: number; // a map's index
  T_map_anchor: PoseNumbers;
  sigma_m: number; // standard deviation of the position, root mean square over its axes
}

export interface Update {
  epoch: number;
  version: number;
  now_s: number;
  playing: boolean;
  speed: number;
  left_out: number;
  // Set in the first update of an epoch: everything received before must be dropped.
  start?: { live: boolean; editable: boolean; source: string; end_s: number; all_fusions: FusionSaid[] };
  maps: MapSaid[];
  agents: AgentSaid[];
  constraints: ConstraintSaid[];
  processes: ProcessSaid[];
  fusions: FusionSaid[];
  anchors: AnchorSaid[];
  notice?: { time_s: number; text: string };
  keyframes: KeyframeSaid[];
  solved: SolvedSaid[];
  view?: ViewSaid;
}

export function decode(bytes: ArrayBuffer): Update {
  const length = new Uint32Array(bytes, 0, 1)[0];
  const json = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 4, length)));
  const integers = new Uint32Array(bytes, 4 + length);
  const floats = new Float32Array(bytes, 4 + length);
  let at = 0;
  const keyframes: KeyframeSaid[] = [];
  for (let i = 0; i < json.keyframes; ++i) {
    const [index, map, seq, points] = integers.subarray(at, at + 4);
    const end = at + 11 + 3 * points;
    keyframes.push({
      index,
      map,
      seq,
      T_odom_body: floats.subarray(at + 4, at + 11),
      points: floats.subarray(at + 11, end),
    });
    at = end;
  }
  const solved: SolvedSaid[] = [];
  for (let i = 0; i < json.solved; ++i, at += 9) {
    solved.push({
      index: integers[at],
      group: integers[at + 1],
      T_map_body: floats.subarray(at + 2, at + 9),
    });
  }
  if (json.view) {
    const tracks: Float32Array[] = [];
    for (let left = integers[at++]; left > 0; --left) {
      const end = at + 1 + 2 * integers[at];
      tracks.push(floats.subarray(at + 1, end));
      at = end;
    }
    json.view.tracks = tracks;
    json.view.image = new Uint8Array(bytes, 4 + length + 4 * (at + 1), integers[at]);
  }
  const none = { maps: [], agents: [], constraints: [], processes: [], fusions: [], anchors: [] };
  return { ...none, ...json, keyframes, solved };
}

export type Said =
  | { taken: number }
  | { seek: number }
  | { play: boolean }
  | { speed: number }
  | { watch: number }
  | { anchor_add: { name: string; keyframe: number; p_body: number[] } }
  | { anchor_move: { anchor: [number, number]; keyframe: number; p_body: number[] } }
  | { anchor_delete: { anchor: [number, number] } };
