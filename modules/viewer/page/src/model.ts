// The page's copy of the scene, and the pose at which each keyframe is drawn.

import { Box3, Matrix4, Quaternion, Vector3 } from "three";
import type {
  AgentSaid, AnchorSaid, ConstraintSaid, FusionSaid, MapSaid, PoseNumbers, ProcessSaid, Update,
} from "./protocol";

export class Pose {
  constructor(public t = new Vector3(), public q = new Quaternion()) {}
  static of(n: PoseNumbers): Pose {
    return new Pose(new Vector3(n[0], n[1], n[2]), new Quaternion(n[4], n[5], n[6], n[3]));
  }
  times(other: Pose): Pose {
    return new Pose().setProduct(this, other);
  }
  copy({ t, q }: Pose): this {
    this.t.copy(t);
    this.q.copy(q);
    return this;
  }
  setProduct(a: Pose, b: Pose): this {
    this.t.copy(b.t).applyQuaternion(a.q).add(a.t);
    this.q.multiplyQuaternions(a.q, b.q);
    return this;
  }
  inverse(): Pose {
    const q = this.q.clone().conjugate();
    return new Pose(this.t.clone().negate().applyQuaternion(q), q);
  }
  apply(p: Vector3): Vector3 {
    return p.clone().applyQuaternion(this.q).add(this.t);
  }
  matrix(): Matrix4 {
    return new Matrix4().compose(this.t, this.q, new Vector3(1, 1, 1));
  }
}

export interface Keyframe {
  map: number;
  seq: number;
  arrived: boolean; // a solved pose may come first
  T_odom_body: Pose;
  solved?: { group: number; T_map_body: Pose };
  target: Pose; // the pose on the stage
  shown: Pose; // the drawn pose, which moves to `target`
}

interface Anchor {
  said: AnchorSaid;
  // The keyframe to which the anchor is attached on the stage, so that it moves with it; -1: none yet.
  holder: number;
  T_holder_anchor: Pose;
  // Where somebody on this page has put it, until the server has a revision after this one.
  moved?: { revision: number; T_holder_anchor: Pose };
}

interface Map_ {
  said: MapSaid;
  T_map_odom: Pose;
  seqs: Map<number, number>; // seq -> index of the keyframe
  newest: number; // index of the keyframe with the highest seq; -1: none
  newestSeq: number;
}

// Metres. A cell of the layout grows in steps of kCellStep, so that a growing map does not move the other maps
// all the time.
const kCellStep = 5;
const kMargin = 3;
const kMaxHolders = 2000; // number of keyframes that are searched for the one nearest to an anchor

export class Model {
  start?: Update["start"];
  now_s = 0;
  playing = true;
  speed = 1;
  leftOut = 0;
  before = false; // show every map by its own odometry, as before the fusion
  maps: Map_[] = [];
  agents = new Map<number, AgentSaid>();
  keyframes: Keyframe[] = [];
  numKeyframes = 0;
  numPoints = 0;
  constraints: ConstraintSaid[] = [];
  processes = new Map<string, ProcessSaid>();
  fusions: FusionSaid[] = [];
  anchors = new Map<number, Anchor>();
  anchorsVersion = 0; // changes when the list of anchors changes
  private unheld = new Set<number>(); // anchors that must be attached to a keyframe
  readonly box = new Box3(); // bounds of the target positions of all keyframes
  private readonly unsettled = new Set<number>(); // keyframes that are new, or not at their target yet

  apply(update: Update) {
    if (update.start) {
      const { before, anchorsVersion } = this;
      Object.assign(this, new Model(), { before, anchorsVersion: anchorsVersion + 1 });
      this.start = update.start;
    }
    this.now_s = update.now_s;
    this.playing = update.playing;
    this.speed = update.speed;
    this.leftOut = update.left_out;
    for (const said of update.maps) {
      const map = this.map(said.index);
      map.said = said;
      map.T_map_odom = Pose.of(said.T_map_odom);
    }
    for (const agent of update.agents) this.agents.set(agent.id, agent);
    for (const process of update.processes) this.processes.set(process.name, process);
    for (const constraint of update.constraints) this.constraints[constraint.index] = constraint;
    this.fusions.push(...update.fusions);
    for (const said of update.keyframes) {
      const keyframe = this.keyframe(said.index);
      keyframe.map = said.map;
      keyframe.seq = said.seq;
      keyframe.arrived = true;
      keyframe.T_odom_body = Pose.of(said.T_odom_body);
      const map = this.map(said.map);
      map.seqs.set(said.seq, said.index);
      if (said.seq > map.newestSeq) {
        map.newestSeq = said.seq;
        map.newest = said.index;
      }
      ++this.numKeyframes;
      this.numPoints += said.points.length / 3;
    }
    for (const said of update.solved) {
      this.keyframe(said.index).solved = {
        group: said.group,
        T_map_body: Pose.of(said.T_map_body),
      };
    }
    for (const said of update.anchors) this.takeAnchor(said);
    if (update.notice) for (const index of this.anchors.keys()) this.putBack(index);
    const placesChange = update.start || update.maps.length + update.keyframes.length + update.solved.length > 0;
    if (placesChange) this.place();
    if (placesChange || update.anchors.length > 0) this.holdAnchors();
    for (const { index } of update.keyframes) {
      const keyframe = this.keyframes[index];
      keyframe.shown.copy(keyframe.target);
      this.unsettled.add(index);
    }
  }

  private map(index: number): Map_ {
    return (this.maps[index] ??= {
      said: { index, agent: 0, name: "", group: index, T_map_odom: [] },
      T_map_odom: new Pose(),
      seqs: new Map(),
      newest: -1,
      newestSeq: -1,
    });
  }

  private keyframe(index: number): Keyframe {
    return (this.keyframes[index] ??= {
      map: -1, seq: -1, arrived: false,
      T_odom_body: new Pose(), target: new Pose(), shown: new Pose(),
    });
  }

  agentOf(keyframe: Keyframe): number {
    return this.maps[keyframe.map]?.said.agent ?? 0;
  }

  // The agents whose maps are in one group with the agent's map.
  fusedWith(agent: AgentSaid): number[] {
    if (agent.map < 0 || !this.maps[agent.map]) return [];
    const group = this.maps[agent.map].said.group;
    const others = this.maps.filter((m) => m && m.said.group === group).map((m) => m.said.agent);
    return [...new Set(others)].filter((id) => id !== agent.id).sort((a, b) => a - b);
  }

  // The keyframes at both ends of a constraint; undefined if one has not arrived.
  ends(constraint: ConstraintSaid): [number, number] | undefined {
    const a = this.maps[constraint.from[0]]?.seqs.get(constraint.from[1]);
    const b = this.maps[constraint.to[0]]?.seqs.get(constraint.to[1]);
    return a === undefined || b === undefined ? undefined : [a, b];
  }

  // The agent's pose relative to the drawn keyframes: from the newest one of its map, by odometry.
  shownPose(agent: AgentSaid): Pose | undefined {
    const map = agent.map < 0 ? undefined : this.maps[agent.map];
    if (!map || map.newest < 0) return undefined;
    const keyframe = this.keyframes[map.newest];
    return keyframe.shown
      .times(keyframe.T_odom_body.inverse())
      .times(Pose.of(agent.T_odom_body));
  }

  // Sets the target of every keyframe: its pose in its group's frame, with the groups side by side.
  place() {
    const boxes: Boxes = new Map();
    for (const keyframe of this.keyframes) {
      if (!keyframe?.arrived) continue;
      const map = this.maps[keyframe.map];
      this.placeInGroup(keyframe, map);
      const { t } = keyframe.target;
      const box = boxes.get(this.cellOf(keyframe));
      if (box) {
        box.min.min(t);
        box.max.max(t);
        box.agent = Math.min(box.agent, map.said.agent);
      } else {
        boxes.set(this.cellOf(keyframe), { min: t.clone(), max: t.clone(), agent: map.said.agent });
      }
    }
    const offsets = layOut(boxes);
    this.box.makeEmpty();
    this.keyframes.forEach((keyframe, k) => {
      if (!keyframe?.arrived) return;
      const { shown, target } = keyframe;
      target.t.add(offsets.get(this.cellOf(keyframe))!);
      this.box.expandByPoint(target.t);
      if (!shown.t.equals(target.t) || !shown.q.equals(target.q)) this.unsettled.add(k);
    });
  }

  private cellOf(keyframe: Keyframe): number {
    return this.before ? keyframe.map : this.maps[keyframe.map].said.group;
  }

  private placeInGroup(keyframe: Keyframe, map: Map_) {
    if (this.before) {
      keyframe.target.copy(keyframe.T_odom_body);
    } else {
      fusedPose(keyframe, map, keyframe.target);
    }
  }

  // --- anchors

  private takeAnchor(said: AnchorSaid) {
    ++this.anchorsVersion;
    const known = this.anchors.get(said.index);
    if (said.gone) {
      this.anchors.delete(said.index);
      this.unheld.delete(said.index);
      return;
    }
    // A moved anchor is near other keyframes now.
    const same = known && known.said.revision === said.revision;
    const moved = known?.moved && said.revision <= known.moved.revision ? known.moved : undefined;
    this.anchors.set(said.index, {
      said,
      holder: moved || same ? known!.holder : -1,
      T_holder_anchor: known?.T_holder_anchor ?? new Pose(),
      moved,
    });
    this.unheld.add(said.index);
  }

  // Attaches the anchors to keyframes. An anchor is at the server's pose in its group's frame. While its keyframe is
  // in another group (after a fusion, before the anchor's new pose has come), it stays attached to that keyframe.
  private holdAnchors() {
    for (const [index, anchor] of this.anchors) {
      const T_map_anchor = Pose.of(anchor.said.T_map_anchor);
      if (!this.isIn(anchor.holder, anchor.said.group)) {
        if (!this.unheld.has(index)) continue;
        const nearest = this.nearestKeyframe(T_map_anchor.t, anchor.said.group);
        if (nearest < 0) continue;
        anchor.holder = nearest;
        anchor.moved = undefined;
      }
      const keyframe = this.keyframes[anchor.holder];
      const T_map_body = fusedPose(keyframe, this.maps[keyframe.map], new Pose());
      anchor.T_holder_anchor = T_map_body.inverse().times(T_map_anchor);
      this.unheld.delete(index);
    }
  }

  private isIn(k: number, group: number): boolean {
    const keyframe = this.keyframes[k];
    return keyframe?.arrived && this.maps[keyframe.map].said.group === group;
  }

  // If there are many keyframes, only every n-th is searched.
  private nearestKeyframe(p_map: Vector3, group: number): number {
    const step = Math.ceil(this.keyframes.length / kMaxHolders);
    const pose = new Pose();
    let nearest = -1;
    let least = Infinity;
    for (let k = 0; k < this.keyframes.length; k += step) {
      if (!this.isIn(k, group)) continue;
      const distance = fusedPose(this.keyframes[k], this.maps[this.keyframes[k].map], pose).t.distanceToSquared(p_map);
      if (distance < least) [nearest, least] = [k, distance];
    }
    return nearest;
  }

  // The anchor's pose on the stage; undefined while it is not attached to a keyframe.
  anchorPose(index: number): Pose | undefined {
    const anchor = this.anchors.get(index);
    const keyframe = anchor && this.keyframes[anchor.holder];
    return keyframe?.shown.times((anchor!.moved ?? anchor!).T_holder_anchor);
  }

  moveAnchor(index: number, position: Vector3) {
    const anchor = this.anchors.get(index);
    if (!anchor || anchor.holder < 0) return;
    const t = this.keyframes[anchor.holder].shown.inverse().apply(position);
    anchor.moved = { revision: anchor.said.revision, T_holder_anchor: new Pose(t, anchor.T_holder_anchor.q) };
  }

  putBack(index: number) {
    const anchor = this.anchors.get(index);
    if (anchor) anchor.moved = undefined;
  }

  get moving(): boolean {
    return this.unsettled.size > 0;
  }

  // Moves the drawn poses towards their targets. Returns the keyframes that moved or are drawn for the first time.
  settle(share: number): number[] {
    const moved = [...this.unsettled];
    for (const k of moved) {
      const { shown, target } = this.keyframes[k];
      const far = shown.t.distanceToSquared(target.t) > 1e-6 || shown.q.angleTo(target.q) > 1e-3;
      if (far) {
        shown.t.lerp(target.t, share);
        shown.q.slerp(target.q, share);
      } else {
        shown.copy(target);
        this.unsettled.delete(k);
      }
    }
    return moved;
  }
}

// The keyframe's pose in its group's frame: optimised, or by its map's odometry. Returns `into`.
function fusedPose({ T_odom_body, solved }: Keyframe, map: Map_, into: Pose): Pose {
  return solved && solved.group === map.said.group
    ? into.copy(solved.T_map_body)
    : into.setProduct(map.T_map_odom, T_odom_body);
}

type Boxes = Map<number, { min: Vector3; max: Vector3; agent: number }>;

// The shifts that put the groups' boxes into the cells of a square grid, ordered by their lowest agent. A single
// group is not shifted.
function layOut(boxes: Boxes): Map<number, Vector3> {
  const cells = [...boxes.entries()].sort(([i, a], [j, b]) => a.agent - b.agent || i - j);
  if (cells.length === 1) return new Map([[cells[0][0], new Vector3()]]);
  const columns = Math.ceil(Math.sqrt(cells.length));
  const step = (size: number) => kCellStep * Math.ceil((size + kMargin) / kCellStep);
  const width = Math.max(0, ...cells.map(([, b]) => step(b.max.x - b.min.x)));
  const depth = Math.max(0, ...cells.map(([, b]) => step(b.max.y - b.min.y)));
  return new Map(
    cells.map(([index, box], i) => {
      const centre = box.min.clone().add(box.max).multiplyScalar(0.5).round();
      return [
        index,
        new Vector3(
          (i % columns) * width - centre.x,
          -Math.floor(i / columns) * depth - centre.y,
          0,
        ),
      ];
    }),
  );
}
