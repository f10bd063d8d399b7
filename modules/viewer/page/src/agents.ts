// Draws one agent: its camera, its path since the newest keyframe (the tail), the ellipse of its uncertainty,
// and its number.

import {
  BufferAttribute, BufferGeometry, Camera, Group, Line, LineBasicMaterial, LineLoop, LineSegments, Matrix4, Vector3,
} from "three";
import { Keyframe, Pose } from "./model";
import { agentColour } from "../../../web/page/palette";
import type { AgentSaid } from "./protocol";

// 95 % of a two-dimensional Gaussian are within this many standard deviations.
const kEllipse95 = 2.4477;
const kTail = 400; // largest number of poses in the tail
const kFrustumDepth = 0.6; // metres

export class AgentDrawing {
  readonly group = new Group();
  private readonly label = document.createElement("span");
  private readonly material: LineBasicMaterial;
  private readonly frustum: LineSegments;
  private readonly ellipse: LineLoop;
  private readonly tail: Line;
  private trail: Vector3[] = []; // in the odom frame of `map`
  private map = -1;
  private tailOf?: Keyframe; // the keyframe at which the tail begins
  private view = ""; // the view from which the frustum was made

  constructor(private agent: AgentSaid, labels: HTMLElement) {
    this.material = new LineBasicMaterial({ color: agentColour(agent.id) });
    const circle = new BufferGeometry().setFromPoints(
      Array.from({ length: 48 }, (_, i) => {
        const angle = (i / 24) * Math.PI;
        return new Vector3(Math.cos(angle), Math.sin(angle), 0);
      }),
    );
    this.frustum = new LineSegments(new BufferGeometry(), this.material);
    this.ellipse = new LineLoop(circle, this.material);
    const tail = new BufferGeometry();
    tail.setAttribute("position", new BufferAttribute(new Float32Array(3 * (kTail + 2)), 3));
    this.tail = new Line(tail, this.material);
    for (const object of [this.frustum, this.ellipse, this.tail]) {
      object.frustumCulled = false;
      object.matrixAutoUpdate = false;
      this.group.add(object);
    }
    this.label.textContent = String(agent.id);
    this.label.style.background = agentColour(agent.id);
    labels.append(this.label);
  }

  remove() {
    this.group.removeFromParent();
    this.label.remove();
    for (const { geometry } of [this.frustum, this.ellipse, this.tail]) geometry.dispose();
    this.material.dispose();
  }

  forgetTrail() {
    this.trail.length = 0;
    this.tailOf = undefined;
  }

  // Takes the agent's newest state.
  take(agent: AgentSaid) {
    this.agent = agent;
    const view = String(agent.view);
    if (view !== this.view) {
      this.view = view;
      this.frustum.geometry.dispose();
      this.frustum.geometry = frustumGeometry(agent);
    }
    if (agent.map < 0) return;
    if (agent.map !== this.map) this.forgetTrail();
    this.map = agent.map;
    const [x, y, z] = Array.from(agent.T_odom_body);
    this.trail.push(new Vector3(x, y, z));
    if (this.trail.length > kTail) this.trail.shift();
    this.tailOf = undefined;
  }

  hide() {
    this.group.visible = false;
    this.label.hidden = true;
  }

  // `pose`: the agent's pose on the stage; `newest`: the newest keyframe of its map.
  place(pose: Pose, newest: Keyframe, ellipseScale: number) {
    this.group.visible = true;
    this.frustum.matrix.copy(pose.times(Pose.of(this.agent.T_body_cam)).matrix());
    this.placeEllipse(pose, ellipseScale);
    if (this.tailOf !== newest) this.makeTail(newest);
    this.tail.matrix.copy(newest.shown.times(newest.T_odom_body.inverse()).matrix());
  }

  placeLabel(pose: Pose, camera: Camera, { clientWidth, clientHeight }: HTMLElement) {
    const at = pose.t.clone().add(new Vector3(0, 0, 0.5)).project(camera);
    this.label.hidden = at.z > 1;
    this.label.style.transform =
      `translate(-50%, -100%) translate(${((at.x + 1) / 2) * clientWidth}px, ${((1 - at.y) / 2) * clientHeight}px)`;
  }

  private placeEllipse(pose: Pose, ellipseScale: number) {
    const c = this.agent.covariance_m2;
    this.ellipse.visible = c !== undefined && ellipseScale > 0;
    if (!c) return;
    // Cholesky: [xx xy; xy yy] = L L^T, and L maps the unit circle to the ellipse.
    const scale = kEllipse95 * ellipseScale;
    const a = Math.sqrt(c[0]);
    const b = c[1] / a;
    const d = Math.sqrt(Math.max(0, c[2] - b * b));
    this.ellipse.matrix.copy(new Matrix4(
      scale * a, 0, 0, pose.t.x,
      scale * b, scale * d, 0, pose.t.y,
      0, 0, 1, pose.t.z,
      0, 0, 0, 1,
    ));
  }

  // The tail begins where the odometry passed the newest keyframe. It is in the odom frame, so an optimisation
  // that moves the map only changes the tail's matrix.
  private makeTail(newest: Keyframe) {
    this.tailOf = newest;
    let from = 0;
    let least = Infinity;
    this.trail.forEach((p, i) => {
      const distance = p.distanceToSquared(newest.T_odom_body.t);
      if (distance < least) [from, least] = [i, distance];
    });
    const positions = this.tail.geometry.getAttribute("position") as BufferAttribute;
    const { t } = newest.T_odom_body;
    positions.setXYZ(0, t.x, t.y, t.z);
    let n = 1;
    for (let i = from; i < this.trail.length; ++i) {
      const p = this.trail[i];
      positions.setXYZ(n++, p.x, p.y, p.z);
    }
    this.tail.geometry.setDrawRange(0, n);
    positions.addUpdateRange(0, 3 * n);
    positions.needsUpdate = true;
  }
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
