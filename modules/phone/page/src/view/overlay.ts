// Anchors over the camera image. Every corner goes through the camera's own lens model, so that what is drawn lies where the
// image has it; three.js draws what comes out in pixels of the screen, nearer things in front.

import {
  BufferAttribute, BufferGeometry, Color, DynamicDrawUsage, Matrix4, Mesh, MeshBasicMaterial, OrthographicCamera, Scene, Vector3,
  WebGLRenderer,
} from "three";
import type { AgentPose, ShownAnchor } from "../agent/phone_agent";
import { kAnchorFaces } from "./anchor_shape";
import { project } from "./camera_model";
import type { CameraModel } from "./camera_model";
import type { Fit, Size } from "./fit";
import { matrixOf } from "./poses";

const kFar_m = 200;
const kMaxAnchors = 200; // the nearest

export interface DrawnAnchor {
  id: string;
  name: string;
  owner: number;
  pixel: [number, number]; // of the image
  distance_m: number;
}

interface Seen extends DrawnAnchor {
  T_cam_anchor: Matrix4;
}

// Anchors whose foot is before the camera, nearest first; off the image too.
export function anchorsBefore(camera: CameraModel, pose: AgentPose, anchors: ShownAnchor[]): Seen[] {
  const T_cam_odom = matrixOf(pose.T_odom_body).multiply(camera.T_body_cam).invert();
  const seen = anchors.flatMap(({ id, name, owner, T_odom_anchor }) => {
    const T_cam_anchor = T_cam_odom.clone().multiply(matrixOf(T_odom_anchor));
    const p_cam = new Vector3().setFromMatrixPosition(T_cam_anchor);
    const pixel = project(camera, p_cam);
    return pixel ? [{ id, name, owner, pixel, distance_m: p_cam.length(), T_cam_anchor }] : [];
  });
  return seen.sort((a, b) => a.distance_m - b.distance_m).slice(0, kMaxAnchors);
}

export class Overlay {
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly camera = new OrthographicCamera();
  private readonly geometry = new BufferGeometry();
  private readonly positions = this.attribute("position");
  private readonly colours = this.attribute("color");
  private readonly labels: HTMLElement[] = [];
  private isClear = true; // nothing is drawn: then a frame costs nothing

  constructor(canvas: HTMLCanvasElement, private readonly labelParent: HTMLElement) {
    this.renderer = new WebGLRenderer({ canvas, alpha: true, antialias: true });
    const mesh = new Mesh(this.geometry, new MeshBasicMaterial({ vertexColors: true, side: 2 }));
    mesh.frustumCulled = false;
    this.scene.add(mesh);
  }

  resize({ width, height }: Size) {
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    // Pixels of the screen, y down; farther away is deeper.
    this.camera.left = this.camera.top = 0;
    [this.camera.right, this.camera.bottom] = [width, height];
    [this.camera.near, this.camera.far] = [0, kFar_m];
    this.camera.updateProjectionMatrix();
  }

  draw(camera: CameraModel, fit: Fit, seen: Seen[], colourOf: (owner: number) => string) {
    if (seen.length === 0) return this.clear();
    this.isClear = false;
    let n = 0;
    for (const { T_cam_anchor, owner } of seen) n = this.addAnchor(camera, fit, T_cam_anchor, new Color(colourOf(owner)), n);
    this.geometry.setDrawRange(0, n);
    this.positions.needsUpdate = this.colours.needsUpdate = true;
    this.renderer.render(this.scene, this.camera);
    this.label(seen, fit);
  }

  clear() {
    if (this.isClear) return;
    this.isClear = true;
    this.geometry.setDrawRange(0, 0);
    this.renderer.render(this.scene, this.camera);
    for (const label of this.labels) label.hidden = true;
  }

  private addAnchor(camera: CameraModel, fit: Fit, T_cam_anchor: Matrix4, colour: Color, n: number): number {
    for (const { corners, brightness } of kAnchorFaces) {
      const points = corners.map((corner) => {
        const p_cam = corner.clone().applyMatrix4(T_cam_anchor);
        const pixel = project(camera, p_cam);
        return pixel && [...fit.toScreen(pixel), -p_cam.z];
      });
      if (!points.every((point) => point !== undefined)) continue; // partly behind the camera
      for (const [x, y, z] of points) {
        this.positions.setXYZ(n, x, y, z);
        this.colours.setXYZ(n++, brightness * colour.r, brightness * colour.g, brightness * colour.b);
      }
    }
    return n;
  }

  private label(seen: DrawnAnchor[], fit: Fit) {
    while (this.labels.length < seen.length) {
      const label = document.createElement("span");
      this.labels.push(label);
      this.labelParent.append(label);
    }
    this.labels.forEach((label, i) => {
      label.hidden = i >= seen.length;
      if (label.hidden) return;
      const { name, pixel, distance_m } = seen[i];
      const [x, y] = fit.toScreen(pixel);
      label.textContent = `${name} · ${distance_m.toFixed(1)} m`;
      label.style.transform = `translate(-50%, 6px) translate(${x}px, ${y}px)`;
    });
  }

  private attribute(name: string): BufferAttribute {
    const attribute = new BufferAttribute(new Float32Array(kMaxAnchors * kAnchorFaces.length * 9), 3);
    attribute.setUsage(DynamicDrawUsage);
    this.geometry.setAttribute(name, attribute);
    return attribute;
  }
}
