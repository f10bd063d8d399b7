// What Foxglove's 3D panel and log panel can show of a captured session, in its own well-known types:
//   /pose/<agent>   foxglove.PoseInFrame     the corrected pose, as the agent shows it
//   /map/<agent>    foxglove.PosesInFrame    its keyframes in the newest complete state of their group
//   /scene          foxglove.SceneUpdate     of each group: its agents' trajectories, its constraints
//   /points/<map>   foxglove.PointCloud      the map points in the end, from the log's beginning on
//   /tf             foxglove.FrameTransform  where a fused map's own frame lies in its group's; each agent's body, to follow it
//   /verification_results       foxglove.Log             every constraint, accepted or why it was refused
// A frame is a map's or its group's, "map 1/1700000000000000" after the map whose odom frame it is, or an agent's: "body 1".

const TRACKING = 2; // pose_t.STATE_TRACKING
const INTRA = 1; // place_candidate_t.KIND_INTRA
const INFO = 2, WARNING = 3; // foxglove.Log levels
const LINE_STRIP = 0, LINE_LIST = 2; // foxglove.LinePrimitive
const FLOAT32 = 7, UINT8 = 1; // foxglove.PackedElementField

const colour = (hex, a = 1) => {
  const [r, g, b] = [16, 8, 0].map((shift) => ((parseInt(hex, 16) >> shift) & 255) / 255);
  return { r, g, b, a };
};
// The report's (Okabe & Ito 2008), but for black, which is no colour on a dark panel.
const AGENTS = ["0072b2", "d55e00", "009e73", "cc79a7", "e69f00", "56b4e9", "ffffff"].map((hex) => colour(hex));
const agentColour = (agent) => AGENTS[(agent - 1) % AGENTS.length];
const ACCEPTED = colour("999999", 0.6), REFUSED = colour("ff3030", 0.8);

export const timeOf = (utime) => ({ sec: Math.floor(utime / 1e6), nsec: (utime % 1e6) * 1000 });
const nameOf = (id) => `${id.agent_id}/${id.opened_utime}`;
const frameOf = (id) => `map ${nameOf(id)}`;
const keyOf = ({ map, seq }) => `${nameOf(map)}#${seq}`;
const poseOf = ({ rotation, translation }) => ({ position: translation, orientation: rotation });
const ORIGIN = { position: { x: 0, y: 0, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 } };

/** The chunks of one state until all have come; then its keyframes. */
class States {
  #pending = new Map();

  add(chunk) {
    const key = `${nameOf(chunk.group)} ${chunk.revision}`;
    const chunks = (this.#pending.get(key) ?? new Map()).set(chunk.chunk, chunk.keyframes ?? []);
    this.#pending.set(key, chunks);
    if (chunks.size < chunk.num_chunks) {
      return [];
    }
    this.#pending.delete(key);
    return [...chunks.values()].flat();
  }
}

function lines(type, points, color, thickness) {
  return { type, pose: ORIGIN, thickness, scale_invariant: true, points, color, colors: [], indices: [] };
}

function grouped(values, keyOfValue) {
  const groups = new Map();
  for (const value of values) {
    const key = keyOfValue(value);
    groups.set(key, [...(groups.get(key) ?? []), value]);
  }
  return groups;
}

const transform = (timestamp, parent_frame_id, child_frame_id, { translation, rotation }) =>
  ["/tf", "foxglove.FrameTransform", { timestamp, parent_frame_id, child_frame_id, translation, rotation }];

/** Everything that can be drawn of a log, message by message. */
export class Drawn {
  #states = new States();
  #frames = new Map(); // the group's frame by map and revision
  #constraints = [];
  #scenes = new Map(); // names of what was drawn, by group

  /** Topic, schema and message of each thing to draw. */
  of({ utime, channel, type, message }) {
    const timestamp = timeOf(utime);
    switch (type) {
      case "correction_t": return this.#correction(timestamp, message);
      case "pose_t": return this.#pose(timestamp, message, channel.slice("POSE_".length));
      case "map_state_t": return channel === "MAP_STATE" ? this.#state(timestamp, message) : [];
      case "constraint_t": return this.#verificationResult(timestamp, message);
      default: return [];
    }
  }

  #correction(timestamp, { map, group, revision, T_map_odom }) {
    this.#frames.set(`${nameOf(map)} ${revision}`, frameOf(group));
    return nameOf(map) === nameOf(group) ? [] : [transform(timestamp, frameOf(group), frameOf(map), T_map_odom)];
  }

  // In whose frame a corrected pose is: the group of the correction it has applied, or its own map.
  #pose(timestamp, { map, group_revision, state, T_map_body }, agent) {
    const frame_id = this.#frames.get(`${nameOf(map)} ${group_revision}`) ?? frameOf(map);
    return state !== TRACKING ? [] : [
      [`/pose/${agent}`, "foxglove.PoseInFrame", { timestamp, frame_id, pose: poseOf(T_map_body) }],
      transform(timestamp, frame_id, `body ${agent}`, T_map_body),
    ];
  }

  #state(timestamp, message) {
    const keyframes = this.#states.add(message);
    if (keyframes.length === 0) {
      return [];
    }
    const frame_id = frameOf(message.group);
    const maps = [...grouped(keyframes, ({ id }) => id.map.agent_id)].map(([agent, of]) =>
      [`/map/${agent}`, "foxglove.PosesInFrame", { timestamp, frame_id, poses: of.map((k) => poseOf(k.T_map_body)) }]);
    return [...maps, ["/scene", "foxglove.SceneUpdate", this.#scene(timestamp, message, keyframes)]];
  }

  #scene(timestamp, { group, maps }, keyframes) {
    const frame_id = frameOf(group);
    const entity = (id, drawn) => ({
      timestamp, frame_id, id: `${frame_id}: ${id}`, lifetime: { sec: 0, nsec: 0 }, frame_locked: false, metadata: [],
      arrows: [], cubes: [], spheres: [], cylinders: [], lines: drawn, triangles: [], texts: [], models: [],
    });
    const trajectories = [...grouped(keyframes, ({ id }) => nameOf(id.map))].map(([map, of]) => {
      const points = of.sort((a, b) => a.id.seq - b.id.seq).map(({ T_map_body }) => T_map_body.translation);
      return entity(`trajectory ${map}`, [lines(LINE_STRIP, points, agentColour(of[0].id.map.agent_id), 3)]);
    });
    const places = new Map(keyframes.map(({ id, T_map_body }) => [keyOf(id), T_map_body.translation]));
    const between = (wanted) => this.#constraints.filter(({ accepted }) => accepted === wanted)
      .map(({ from, to }) => [places.get(keyOf(from)), places.get(keyOf(to))]).filter(([a, b]) => a && b).flat();
    const entities = [...trajectories,
      entity("accepted", [lines(LINE_LIST, between(true), ACCEPTED, 1)]),
      entity("refused", [lines(LINE_LIST, between(false), REFUSED, 1)])];
    // Groups that became part of this one, and what this one no longer has.
    const now = new Set(entities.map(({ id }) => id));
    const gone = new Set(maps.flatMap((map) => this.#scenes.get(nameOf(map)) ?? []).filter((id) => !now.has(id)));
    maps.forEach((map) => this.#scenes.delete(nameOf(map)));
    this.#scenes.set(nameOf(group), [...now]);
    return { deletions: [...gone].map((id) => ({ timestamp, type: 0, id })), entities };
  }

  #verificationResult(timestamp, constraint) {
    this.#constraints.push(constraint);
    const { id, from, to, kind, accepted, reason } = constraint;
    return [["/verification_results", "foxglove.Log", {
      timestamp, level: accepted ? INFO : WARNING, name: kind === INTRA ? "inter_map_ba" : "fusion",
      message: `${id}: ${keyOf(to)} in ${keyOf(from)}: ${accepted ? "accepted" : reason}`, file: "", line: 0,
    }]];
  }
}

/** The points of `pangea-log export --ply` as a cloud. */
export function cloudOf(ply, utime) {
  const [header, body] = ply.split("end_header\n");
  const map = /odom of map ([^,\s]+)/.exec(header)[1];
  const rows = body.trim().split("\n").filter((row) => row !== "").map((row) => row.split(" ").map(Number));
  const stride = 16;
  const data = Buffer.alloc(stride * rows.length);
  rows.forEach(([x, y, z, red, green, blue], i) => {
    [x, y, z].forEach((value, axis) => data.writeFloatLE(value, stride * i + 4 * axis));
    data.set([red, green, blue, 255], stride * i + 12);
  });
  const fields = [
    ...["x", "y", "z"].map((name, i) => ({ name, offset: 4 * i, type: FLOAT32 })),
    ...["red", "green", "blue", "alpha"].map((name, i) => ({ name, offset: 12 + i, type: UINT8 })),
  ];
  return [`/points/${map}`, "foxglove.PointCloud", {
    timestamp: timeOf(utime), frame_id: `map ${map}`, pose: ORIGIN, point_stride: stride, fields, data: data.toString("base64"),
  }];
}
