// Draws the anchors: a marker with the same size on the screen at any distance, the name, and the axes of the
// chosen anchor.

import {
  AxesHelper, Camera, Color, DynamicDrawUsage, Group, InstancedMesh, Matrix4, MeshBasicMaterial, OctahedronGeometry,
  Vector3,
} from "three";
import type { Pose } from "./model";
import { colours } from "../../../web/page/palette";

const kMarkerSize = 0.009; // share of the distance to the camera
const kAxesSize = 0.06;
const kMaxLabels = 100; // only the nearest anchors show their names; more would not be readable

interface PlacedAnchor {
  index: number;
  name: string;
  pose: Pose; // on the stage
}

export class AnchorDrawings {
  readonly object = new Group();
  chosen = -1;
  private readonly geometry = new OctahedronGeometry(1);
  private readonly material = new MeshBasicMaterial();
  private readonly axes = new AxesHelper(1);
  private readonly labels: HTMLElement[] = [];
  private mesh = this.makeMesh(16);

  constructor(private readonly parent: HTMLElement) {
    this.object.add(this.axes);
    this.axes.matrixAutoUpdate = false;
    this.axes.frustumCulled = false;
  }

  recolour() {
    this.material.color = new Color(colours().anchor);
  }

  place(anchors: PlacedAnchor[], camera: Camera, { clientWidth, clientHeight }: HTMLElement) {
    if (anchors.length > this.mesh.instanceMatrix.count) this.mesh = this.makeMesh(2 * anchors.length);
    this.mesh.count = anchors.length;
    this.axes.visible = false;
    const seen: { name: string; at: Vector3; distance: number }[] = [];
    anchors.forEach(({ index, name, pose }, i) => {
      const distance = camera.position.distanceTo(pose.t);
      const scaled = (size: number) =>
        new Matrix4().compose(pose.t, pose.q, new Vector3().setScalar(size * distance));
      this.mesh.setMatrixAt(i, scaled(kMarkerSize));
      if (index === this.chosen) {
        this.axes.visible = true;
        this.axes.matrix.copy(scaled(kAxesSize));
      }
      const at = pose.t.clone().project(camera);
      if (Math.abs(at.x) < 1 && Math.abs(at.y) < 1 && at.z < 1) seen.push({ name, at, distance });
    });
    this.mesh.instanceMatrix.needsUpdate = true;
    if (seen.length > kMaxLabels) seen.sort((a, b) => a.distance - b.distance).length = kMaxLabels;
    this.label(this.object.visible ? seen : [], clientWidth, clientHeight);
  }

  private label(seen: { name: string; at: Vector3 }[], width: number, height: number) {
    while (this.labels.length < seen.length) {
      const label = document.createElement("span");
      label.className = "anchor_label";
      this.labels.push(label);
      this.parent.append(label);
    }
    this.labels.forEach((label, i) => {
      label.hidden = i >= seen.length;
      if (label.hidden) return;
      const { name, at } = seen[i];
      if (label.textContent !== name) label.textContent = name;
      label.style.transform =
        `translate(12px, -50%) translate(${((at.x + 1) / 2) * width}px, ${((1 - at.y) / 2) * height}px)`;
    });
  }

  private makeMesh(capacity: number): InstancedMesh {
    this.mesh?.removeFromParent();
    this.mesh?.dispose();
    const mesh = new InstancedMesh(this.geometry, this.material, capacity);
    mesh.instanceMatrix.setUsage(DynamicDrawUsage);
    mesh.frustumCulled = false;
    mesh.count = 0;
    this.object.add(mesh);
    return mesh;
  }
}
