// The drawing: points, trajectories, constraints, agents. For a frame, only data that changed since the last frame
// are sent to the graphics card.

import { Box3, Color, GridHelper, PerspectiveCamera, Scene, Vector2, Vector3, WebGLRenderer } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { AgentDrawing } from "./agents";
import { AnchorDrawings } from "./anchors";
import { Lines, PointCloud } from "./buffers";
import { Model } from "./model";
import { type Drawn, Picking } from "./picking";
import type { AgentSaid, ConstraintSaid, Update } from "./protocol";
import { agentColour, colours } from "../../../web/page/palette";
import { lineMaterial, pointMaterial, PoseTexture } from "./shaders";

const kFlight_m = 3; // distance from an anchor at the end of a flight to it
const kSettle_ms = 350; // time constant (1/e) with which things move to their target

const wantsStill = matchMedia("(prefers-reduced-motion: reduce)");

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
  private readonly anchors: AnchorDrawings;
  readonly picking: Picking;
  private flight?: { target: Vector3; position: Vector3 };
  private readonly colourOf = new Map<number, Color>(); // by agent
  private grid?: GridHelper;
  private readonly drawnConstraints = new Set<number>();
  private readonly waitingConstraints = new Set<number>(); // not drawn yet: new, or a keyframe is missing
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
    this.controls.addEventListener("start", () => {
      this.userMoved = true;
      this.flight = undefined;
    });
    this.points = new PointCloud(pointMaterial(this.poses.uniform, this.pointSize));
    this.trajectories = new Lines(lineMaterial(this.poses.uniform, this.screen, 3, 0.95));
    this.accepted = new Lines(lineMaterial(this.poses.uniform, this.screen, 1.2, 0.35));
    this.refused = new Lines(lineMaterial(this.poses.uniform, this.screen, 1.3, 0.7));
    this.hovered = new Lines(lineMaterial(this.poses.uniform, this.screen, 5, 1));
    for (const drawn of [this.points, this.trajectories, this.accepted, this.refused, this.hovered]) {
      this.scene.add(drawn.object);
    }
    this.anchors = new AnchorDrawings(labels);
    this.scene.add(this.anchors.object);
    this.refused.object.visible = false;
    this.picking = new Picking(this.camera, canvas, model, this.points, (what) => this[what].object.visible);
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.recolour();
  }

  // Sets the colours of the current theme.
  recolour() {
    this.scene.background = new Color(colours().background);
    this.removeGrid();
    for (const drawing of this.agents.values()) drawing.remove();
    this.agents.clear();
    for (const agent of this.model.agents.values()) this.drawing(agent).take(agent);
    this.anchors.recolour();
    this.colourOf.clear();
    this.model.keyframes.forEach((_, k) => this.writePose(k));
    this.redrawConstraints();
    this.redraw();
  }

  redraw() {
    this.dirty = this.posesDirty = true;
  }

  show(what: Drawn, visible: boolean) {
    this[what].object.visible = visible;
    this.dirty = true;
  }

  take(update: Update) {
    if (update.start) {
      this.poses.clear();
      this.points.clear();
      this.trajectories.clear();
      this.waitingConstraints.clear();
      this.redrawConstraints();
      for (const drawing of this.agents.values()) drawing.forgetTrail();
    }
    for (const said of update.keyframes) {
      this.points.add(said.index, said.points);
      this.connect(said.map, said.seq, said.index);
    }
    for (const agent of update.agents) this.drawing(agent).take(agent);
    for (const { index } of update.constraints) this.waitingConstraints.add(index);
    if (update.constraints.some(({ index }) => this.drawnConstraints.has(index))) this.redrawConstraints();
    this.redraw();
  }

  // Draws lines to the keyframes before and after it in its map, if they are there.
  private connect(map: number, seq: number, index: number) {
    const { seqs } = this.model.maps[map];
    const before = seqs.get(seq - 1);
    const after = seqs.get(seq + 1);
    // If both neighbours are new in one update, both come here; only the one with the higher index draws.
    if (before !== undefined) this.trajectories.add(before, index, [-1, 0, 0, 0]);
    if (after !== undefined && after < index) this.trajectories.add(index, after, [-1, 0, 0, 0]);
  }

  private drawing(agent: AgentSaid): AgentDrawing {
    const known = this.agents.get(agent.id);
    if (known) return known;
    const drawing = new AgentDrawing(agent, this.labels);
    this.scene.add(drawing.group);
    this.agents.set(agent.id, drawing);
    return drawing;
  }

  private drawAgents() {
    for (const [id, drawing] of this.agents) {
      const agent = this.model.agents.get(id);
      const pose = agent && this.model.shownPose(agent);
      if (!pose) {
        drawing.hide();
        continue;
      }
      const newest = this.model.keyframes[this.model.maps[agent.map].newest];
      drawing.place(pose, newest, this.model.before ? 0 : this.ellipseScale);
      drawing.placeLabel(pose, this.camera, this.renderer.domElement);
    }
  }

  private drawAnchors() {
    const placed = [...this.model.anchors.values()].flatMap(({ said: { index, name } }) => {
      const pose = this.model.anchorPose(index);
      return pose ? [{ index, name, pose }] : [];
    });
    this.anchors.place(placed, this.camera, this.renderer.domElement);
  }

  private writePose(k: number) {
    const keyframe = this.model.keyframes[k];
    if (!keyframe?.arrived) return;
    const agent = this.model.agentOf(keyframe);
    const colour = this.colourOf.get(agent) ?? new Color(agentColour(agent));
    this.colourOf.set(agent, colour);
    this.poses.set(k, keyframe.shown, colour);
  }

  private redrawConstraints() {
    this.accepted.clear();
    this.refused.clear();
    this.drawnConstraints.clear();
    this.model.constraints.forEach((_, index) => this.waitingConstraints.add(index));
  }

  private drawConstraints() {
    for (const index of this.waitingConstraints) {
      const constraint = this.model.constraints[index];
      const ends = this.model.ends(constraint);
      if (!ends) continue;
      (constraint.accepted ? this.accepted : this.refused).add(...ends, styleOf(constraint));
      this.drawnConstraints.add(index);
      this.waitingConstraints.delete(index);
    }
  }

  highlight(constraint: ConstraintSaid | undefined) {
    this.hovered.clear();
    const ends = constraint && this.model.ends(constraint);
    if (ends) this.hovered.add(...ends, styleOf(constraint));
    this.dirty = true;
  }

  // --- anchors

  get chosenAnchor(): number {
    return this.anchors.chosen;
  }

  choose(index: number | undefined) {
    this.anchors.chosen = index ?? -1;
    this.dirty = true;
  }

  viewDirection(): Vector3 {
    return this.camera.getWorldDirection(new Vector3());
  }

  // While held, the pointer does not move the camera.
  holdCamera(held: boolean) {
    this.controls.enabled = !held;
  }

  // Moves the camera to the anchor without changing its direction.
  flyTo(index: number) {
    const pose = this.model.anchorPose(index);
    this.choose(index);
    if (!pose) return;
    this.userMoved = true;
    const back = this.viewDirection().multiplyScalar(-kFlight_m);
    this.flight = { target: pose.t.clone(), position: pose.t.clone().add(back) };
  }

  private fly(share: number) {
    if (!this.flight) return;
    const { target, position } = this.flight;
    this.controls.target.lerp(target, share);
    this.camera.position.lerp(position, share);
    if (this.camera.position.distanceTo(position) < 1e-3 * kFlight_m) this.flight = undefined;
    this.dirty = true;
  }

  fit() {
    this.userMoved = false;
    this.flight = undefined;
    this.fittedTo.makeEmpty();
    this.redraw();
  }

  // Keeps everything in view until the user takes the camera.
  private followBounds(share: number): boolean {
    if (this.model.box.isEmpty()) return false;
    const box = this.model.box.clone().expandByScalar(1.5);
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
    this.removeGrid();
    const colour = colours().grid;
    this.grid = new GridHelper(cells * this.gridCell_m, cells, colour, colour);
    this.grid.rotation.x = Math.PI / 2;
    this.grid.position.set(place[2], place[3], place[4]);
    this.grid.userData.place = place;
    this.scene.add(this.grid);
  }

  private removeGrid() {
    this.grid?.removeFromParent();
    this.grid?.dispose();
    this.grid = undefined;
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

  // Draws a frame if anything moved, and returns whether it did.
  frame(now_ms: number, always = false): boolean {
    const share = 1 - Math.exp(-(now_ms - this.last_ms) / kSettle_ms);
    this.last_ms = now_ms;
    const step = wantsStill.matches ? 1 : share;
    if (this.posesDirty) {
      this.drawConstraints();
      for (const k of this.model.settle(step)) this.writePose(k);
      const following = this.followBounds(step);
      this.posesDirty = this.model.moving || following;
      this.dirty = true;
    }
    this.fly(step);
    this.controls.update();
    if (!this.dirty && !always) return false;
    this.dirty = false;
    this.drawAgents();
    this.drawAnchors();
    this.renderer.render(this.scene, this.camera);
    return true;
  }
}

function styleOf(constraint: ConstraintSaid): [number, number, number, number] {
  const { accepted, refused } = colours();
  const colour = new Color(constraint.accepted ? accepted : refused);
  return [colour.r, colour.g, colour.b, constraint.accepted ? 0 : 5];
}

function tooLarge(fitted: Box3, box: Box3): boolean {
  return fitted.getSize(new Vector3()).length() > 1.6 * box.getSize(new Vector3()).length();
}
