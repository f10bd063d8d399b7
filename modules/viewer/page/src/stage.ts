// The drawing: points, trajectories, constraints, and each agent's camera, tail and ellipse.

import {
  BufferAttribute, BufferGeometry, Box3, Color, GridHelper, Group, Line, LineBasicMaterial,
  LineLoop, LineSegments, PerspectiveCamera, Scene, Vector2, Vector3, WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { Lines, PointCloud } from "./buffers";
import { Model, Pose } from "./model";
import type { AgentSaid, ConstraintSaid, Update } from "./protocol";
import { agentColour, colours } from "./palette";
import { lineMaterial, pointMaterial, PoseTexture } from "./shaders";

// 95 % of a two-dimensional Gaussian lie within this many standard deviations.
const kEllipse95 = 2.4477;
const kTail = 400; // poses of an agent since its newest keyframe
const kFrustumDepth = 0.6; // metres
const kHoverPixels = 8;

interface AgentDrawing {
  group: Group;
  frustum: LineSegments;
  ellipse: LineLoop;
  tail: Line;
  trail: { map: number; p_odom: Vector3 }[];
  label: HTMLElement;
  view: string; // what the frustum was made of
}

export class Stage {
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly camera = new PerspectiveCamera(50, 1, 0.05, 5000);
  private readonly controls: OrbitControls;
  private readonly poses = new PoseTexture();
  private readonly screen = { value: new Vector2(1, 1) };
  private readonly pointSize = { value: 2.2 };
  private readonly points: PointCloud;
  private readonly trajectories: Lines;
  private readonly accepted: Lines;
  private readonly refused: Lines;
  private readonly hovered: Lines;
  private readonly agents = new Map<number, AgentDrawing>();
  private grid?: GridHelper;
  private constraintsDrawn = -1;
  private userMoved = false;
  private fittedTo = new Box3();
  private dirty = true;
  private posesDirty = true;
  private last_ms = 0;
  ellipseScale = 10;
  gridCell_m = 1;

  constructor(
    canvas: HTMLCanvasElement,
    private readonly labels: HTMLElement,
    private readonly model: Model,
  ) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.camera.up.set(0, 0, 1);
    this.camera.position.set(-8, -14, 14);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.maxPolarAngle = 0.49 * Math.PI;
    this.controls.addEventListener("change", () => (this.dirty = true));
    this.controls.addEventListener("start", () => (this.userMoved = true));
    this.points = new PointCloud(pointMaterial(this.poses.uniform, this.pointSize));
    this.trajectories = new Lines(lineMaterial(this.poses.uniform, this.screen, 3, 0, 0.95));
    this.accepted = new Lines(lineMaterial(this.poses.uniform, this.screen, 1.3, 1e-4, 0.5));
    this.refused = new Lines(lineMaterial(this.poses.uniform, this.screen, 1.3, 1e-4, 0.7));
    this.hovered = new Lines(lineMaterial(this.poses.uniform, this.screen, 5, 2e-4, 1));
    for (const drawn of [this.points, this.trajectories, this.accepted, this.refused, this.hovered]) {
      this.scene.add(drawn.object);
    }
    this.refused.object.visible = false;
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.recolour();
  }

  // Colours of the theme.
  recolour() {
    this.scene.background = new Color(colours().background);
    if (this.grid) this.scene.remove(this.grid);
    this.grid = undefined;
    this.constraintsDrawn = -1;
    for (const drawing of this.agents.values()) {
      drawing.group.removeFromParent();
      drawing.label.remove();
    }
    this.agents.clear();
    this.redraw();
  }

  redraw() {
    this.dirty = this.posesDirty = true;
  }

  show(what: "points" | "accepted" | "refused", visible: boolean) {
    this[what].object.visible = visible;
    this.dirty = true;
  }

  take(update: Update) {
    if (update.start) {
      this.points.clear();
      this.trajectories.clear();
      this.constraintsDrawn = -1;
      for (const drawing of this.agents.values()) drawing.trail.length = 0;
    }
    for (const said of update.keyframes) {
      this.points.add(said.index, said.points);
      this.connect(said.map, said.seq, said.index);
    }
    for (const agent of update.agents) this.extendTail(agent);
    if (update.constraints.length + update.keyframes.length > 0) this.constraintsDrawn = -1;
    this.redraw();
  }

  // A line to the keyframes before and after it in its map, if they are there already.
  private connect(map: number, seq: number, index: number) {
    const { seqs } = this.model.maps[map];
    const before = seqs.get(seq - 1);
    const after = seqs.get(seq + 1);
    // Of two neighbours in one update both ask: the later one draws.
    if (before !== undefined) this.trajectories.add(before, index, [-1, 0, 0, 0]);
    if (after !== undefined && after < index) this.trajectories.add(index, after, [-1, 0, 0, 0]);
  }

  private extendTail(agent: AgentSaid) {
    const drawing = this.drawing(agent);
    if (agent.map < 0) return;
    drawing.trail.push({ map: agent.map, p_odom: Pose.of(agent.T_odom_body).t });
    if (drawing.trail.length > kTail) drawing.trail.shift();
  }

  private drawing(agent: AgentSaid): AgentDrawing {
    const known = this.agents.get(agent.id);
    if (known) return known;
    const material = new LineBasicMaterial({ color: agentColour(agent.id) });
    const circle = new BufferGeometry().setFromPoints(
      Array.from({ length: 48 }, (_, i) => {
        const angle = (i / 24) * Math.PI;
        return new Vector3(Math.cos(angle), Math.sin(angle), 0);
      }),
    );
    const frustum = new LineSegments(frustumGeometry(agent), material);
    const ellipse = new LineLoop(circle, material);
    ellipse.matrixAutoUpdate = false;
    const tailGeometry = new BufferGeometry();
    tailGeometry.setAttribute("position", new BufferAttribute(new Float32Array(3 * (kTail + 2)), 3));
    const tail = new Line(tailGeometry, material);
    for (const object of [frustum, ellipse, tail]) object.frustumCulled = false;
    frustum.matrixAutoUpdate = false;
    const group = new Group();
    group.add(frustum, ellipse, tail);
    this.scene.add(group);
    const label = document.createElement("span");
    label.textContent = String(agent.id);
    label.style.background = agentColour(agent.id);
    this.labels.append(label);
    const drawing = { group, frustum, ellipse, tail, trail: [], label, view: String(agent.view) };
    this.agents.set(agent.id, drawing);
    return drawing;
  }

  private drawAgents() {
    const present = new Set<number>();
    for (const agent of this.model.agents.values()) {
      const pose = this.model.shownPose(agent);
      const drawing = this.drawing(agent);
      present.add(agent.id);
      drawing.group.visible = pose !== undefined;
      drawing.label.hidden = pose === undefined;
      if (!pose) continue;
      if (drawing.view !== String(agent.view)) {
        drawing.view = String(agent.view);
        drawing.frustum.geometry.dispose();
        drawing.frustum.geometry = frustumGeometry(agent);
      }
      drawing.frustum.matrix.copy(pose.times(Pose.of(agent.T_body_cam)).matrix());
      this.drawEllipse(agent, pose, drawing.ellipse);
      this.drawTail(agent, pose, drawing);
      const at = pose.t.clone().add(new Vector3(0, 0, 0.5)).project(this.camera);
      const { clientWidth, clientHeight } = this.renderer.domElement;
      drawing.label.style.transform =
        `translate(-50%, -100%) translate(${((at.x + 1) / 2) * clientWidth}px, ${((1 - at.y) / 2) * clientHeight}px)`;
      drawing.label.hidden = at.z > 1;
    }
    for (const [id, drawing] of this.agents) {
      if (!present.has(id)) {
        drawing.group.visible = false;
        drawing.label.hidden = true;
      }
    }
  }

  private drawEllipse(agent: AgentSaid, pose: Pose, ellipse: LineLoop) {
    const c = agent.covariance_m2;
    ellipse.visible = c !== undefined && this.ellipseScale > 0 && !this.model.before;
    if (!c) return;
    // Cholesky: [xx xy; xy yy] = L L^T, and L takes the unit circle to the ellipse.
    const scale = kEllipse95 * this.ellipseScale;
    const a = Math.sqrt(c[0]);
    const b = c[1] / a;
    const d = Math.sqrt(Math.max(0, c[2] - b * b));
    ellipse.matrix.set(
      scale * a, 0, 0, pose.t.x,
      scale * b, scale * d, 0, pose.t.y,
      0, 0, 1, pose.t.z,
      0, 0, 0, 1,
    );
  }

  // From the newest keyframe to where the agent is.
  private drawTail(agent: AgentSaid, pose: Pose, drawing: AgentDrawing) {
    const map = this.model.maps[agent.map];
    const keyframe = this.model.keyframes[map.newest];
    const shown_odom = keyframe.shown.times(keyframe.T_odom_body.inverse());
    const trail = drawing.trail.filter((at) => at.map === agent.map);
    // Where odometry passed the newest keyframe.
    let from = 0;
    let least = Infinity;
    trail.forEach(({ p_odom }, i) => {
      const distance = p_odom.distanceToSquared(keyframe.T_odom_body.t);
      if (distance < least) [from, least] = [i, distance];
    });
    const positions = drawing.tail.geometry.getAttribute("position") as BufferAttribute;
    let n = 0;
    const add = (p: Vector3) => positions.setXYZ(n++, p.x, p.y, p.z);
    add(keyframe.shown.t);
    for (const { p_odom } of trail.slice(from)) add(shown_odom.apply(p_odom));
    add(pose.t);
    drawing.tail.geometry.setDrawRange(0, n);
    positions.needsUpdate = true;
  }

  private drawConstraints() {
    this.constraintsDrawn = this.model.constraints.length;
    this.accepted.clear();
    this.refused.clear();
    for (const constraint of this.model.constraints) {
      const ends = constraint && this.model.ends(constraint);
      if (ends) (constraint.accepted ? this.accepted : this.refused).add(...ends, styleOf(constraint));
    }
  }

  // The constraint under the pointer, among those shown.
  constraintAt(x: number, y: number): ConstraintSaid | undefined {
    let best: ConstraintSaid | undefined;
    let least = kHoverPixels;
    for (const constraint of this.model.constraints) {
      if (!constraint || !(constraint.accepted ? this.accepted : this.refused).object.visible) continue;
      const ends = this.onScreen(constraint);
      const distance = ends ? distanceToSegment(new Vector2(x, y), ...ends) : Infinity;
      if (distance < least) [best, least] = [constraint, distance];
    }
    return best;
  }

  highlight(constraint: ConstraintSaid | undefined) {
    this.hovered.clear();
    const ends = constraint && this.model.ends(constraint);
    if (ends) this.hovered.add(...ends, styleOf(constraint));
    this.dirty = true;
  }

  // Both ends in pixels of the canvas; nothing behind the camera.
  onScreen(constraint: ConstraintSaid): [Vector2, Vector2] | undefined {
    const ends = this.model.ends(constraint);
    if (!ends) return undefined;
    const { clientWidth, clientHeight } = this.renderer.domElement;
    const [a, b] = ends.map((k) => this.model.keyframes[k].shown.t.clone().project(this.camera));
    if (a.z > 1 || b.z > 1) return undefined;
    const pixel = (p: Vector3) =>
      new Vector2(((p.x + 1) / 2) * clientWidth, ((1 - p.y) / 2) * clientHeight);
    return [pixel(a), pixel(b)];
  }

  private bounds(): Box3 {
    const box = new Box3();
    for (const keyframe of this.model.keyframes) {
      if (keyframe?.arrived) box.expandByPoint(keyframe.target.t);
    }
    return box.isEmpty() ? box : box.expandByScalar(1.5);
  }

  fit() {
    this.userMoved = false;
    this.fittedTo.makeEmpty();
    this.redraw();
  }

  // Keeps everything in view until the user takes the camera.
  private followBounds(share: number): boolean {
    const box = this.bounds();
    if (box.isEmpty()) return false;
    this.drawGrid(box);
    if (this.userMoved) return false;
    if (!this.fittedTo.containsBox(box) || tooLarge(this.fittedTo, box)) {
      this.fittedTo.copy(box).expandByVector(box.getSize(new Vector3()).multiplyScalar(0.1));
    }
    const centre = this.fittedTo.getCenter(new Vector3());
    const size = this.fittedTo.getSize(new Vector3());
    const half = Math.tan((this.camera.fov / 360) * Math.PI);
    const distance =
      Math.max(size.x / this.camera.aspect, 0.8 * size.y + 0.5 * size.z, 3) / (2 * half) + 0.45 * size.y;
    const position = centre.clone().add(new Vector3(0, -0.62, 0.78).multiplyScalar(distance));
    const far = this.camera.position.distanceTo(position) > 0.01 * distance;
    this.camera.position.lerp(position, far ? share : 1);
    this.controls.target.lerp(centre, far ? share : 1);
    return far;
  }

  private drawGrid(box: Box3) {
    const size = box.getSize(new Vector3());
    const extent = Math.max(size.x, size.y);
    this.gridCell_m = extent < 40 ? 1 : extent < 200 ? 5 : 20;
    const cells = 2 * Math.ceil((0.75 * extent + 4) / this.gridCell_m / 4) * 2;
    const centre = box.getCenter(new Vector3());
    const snapped = (value: number) => Math.round(value / this.gridCell_m / 4) * this.gridCell_m * 4;
    const place = [cells, this.gridCell_m, snapped(centre.x), snapped(centre.y), Math.floor(box.min.z)];
    if (this.grid && String(this.grid.userData.place) === String(place)) return;
    if (this.grid) {
      this.scene.remove(this.grid);
      this.grid.dispose();
    }
    const colour = colours().grid;
    this.grid = new GridHelper(cells * this.gridCell_m, cells, colour, colour);
    this.grid.rotation.x = Math.PI / 2;
    this.grid.position.set(place[2], place[3], place[4]);
    this.grid.userData.place = place;
    this.scene.add(this.grid);
  }

  private resize() {
    const { clientWidth, clientHeight } = this.renderer.domElement;
    if (clientWidth === 0 || clientHeight === 0) return;
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.camera.aspect = clientWidth / clientHeight;
    this.camera.updateProjectionMatrix();
    this.screen.value.set(clientWidth, clientHeight);
    this.pointSize.value = 2.2 * this.renderer.getPixelRatio();
    this.redraw();
  }

  // Draws if anything moved. Returns whether it did.
  frame(now_ms: number, always = false): boolean {
    const share = 1 - Math.exp(-Math.min(now_ms - this.last_ms, 100) / 350);
    this.last_ms = now_ms;
    const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    if (this.posesDirty) {
      if (this.constraintsDrawn < 0) this.drawConstraints();
      const coloursOf = new Map<number, Color>();
      const moving = this.model.settle(still ? 1 : share);
      this.poses.write(this.model.keyframes, (keyframe) => {
        const agent = this.model.agentOf(keyframe);
        const known = coloursOf.get(agent) ?? new Color(agentColour(agent));
        coloursOf.set(agent, known);
        return known;
      });
      const following = this.followBounds(still ? 1 : share);
      this.posesDirty = moving || following;
      this.dirty = true;
    }
    this.controls.update();
    if (!this.dirty && !always) return false;
    this.dirty = false;
    this.drawAgents();
    this.renderer.render(this.scene, this.camera);
    return true;
  }
}

function styleOf(constraint: ConstraintSaid): [number, number, number, number] {
  const { accepted, refused } = colours();
  const colour = new Color(constraint.accepted ? accepted : refused);
  return [colour.r, colour.g, colour.b, constraint.accepted ? 0 : 5];
}

function frustumGeometry(agent: AgentSaid): BufferGeometry {
  const [left, top, right, bottom] = agent.view;
  const corner = (x: number, y: number) => new Vector3(x, y, 1).multiplyScalar(kFrustumDepth);
  const corners = [corner(left, top), corner(right, top), corner(right, bottom), corner(left, bottom)];
  const eye = new Vector3();
  return new BufferGeometry().setFromPoints(
    corners.flatMap((c, i) => [eye, c, c, corners[(i + 1) % 4]]),
  );
}

function distanceToSegment(p: Vector2, a: Vector2, b: Vector2): number {
  const ab = b.clone().sub(a);
  const along = ab.lengthSq() > 0 ? p.clone().sub(a).dot(ab) / ab.lengthSq() : 0;
  return p.distanceTo(a.clone().addScaledVector(ab, Math.min(1, Math.max(0, along))));
}

function tooLarge(fitted: Box3, box: Box3): boolean {
  return fitted.getSize(new Vector3()).length() > 1.6 * box.getSize(new Vector3()).length();
}
