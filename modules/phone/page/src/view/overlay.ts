// Draws anchors and other people's cameras over the camera image. Every corner is projected with the camera's own lens model, so that
// it is at the right place in the image. three.js then draws in screen pixels, nearer things in front.

import {
  BufferAttribute, BufferGeometry, Color, DynamicDrawUsage, Matrix4, Mesh, MeshBasicMaterial, OrthographicCamera, Scene, Vector3,
  WebGLRenderer,
} from "three";
import type { WebGLRenderTarget } from "three";
import type { PhonePose, Pose7 } from "../agent/phone_agent";
import { kAnchorFaces } from "./anchor_shape";
import { project } from "./camera_model";
import type { CameraModel } from "./camera_model";
import type { CameraMotion } from "./camera_motion";
import type { Fit, Size } from "./fit";
import { kFrustumEdges } from "./frustum";
import { matrixOf } from "./poses";

const kFar_m = 200;
const kMaxThings = 200; // only the nearest are drawn
const kEdge_px = 3;
const kVertices = Math.max(3 * kAnchorFaces.length, 6 * kFrustumEdges.length);

export interface Thing {
  name: string;
  owner: number;
  T_odom_thing: Pose7;
  id?: string; // the anchor's id; undefined: a person's camera
}

export interface DrawnThing {
  id?: string;
  name: string;
  owner: number;
  pixel: [number, number]; // in the image
  distance_m: number;
}

interface Seen extends DrawnThing {
  T_cam_thing: Matrix4;
}

// The things whose origin is in front of the camera, nearest first, also those outside the image. Each is where the row that sees its
// origin sees it, if the motion is known.
export function thingsBefore(camera: CameraModel, pose: PhonePose, things: Thing[], motion?: CameraMotion): Seen[] {
  const T_cam_odom = matrixOf(pose.T_odom_body).multiply(camera.T_body_cam).invert();
  const seen = things.flatMap(({ T_odom_thing, ...thing }) => {
    const T_cam_thing = T_cam_odom.clone().multiply(matrixOf(T_odom_thing));
    const inFirstRow = project(camera, new Vector3().setFromMatrixPosition(T_cam_thing));
    if (motion && inFirstRow) T_cam_thing.premultiply(motion.after(secondsOfRow(camera, inFirstRow[1])));
    const p_cam = new Vector3().setFromMatrixPosition(T_cam_thing);
    const pixel = project(camera, p_cam);
    return pixel ? [{ ...thing, pixel, distance_m: p_cam.length(), T_cam_thing }] : [];
  });
  return seen.sort((a, b) => a.distance_m - b.distance_m).slice(0, kMaxThings);
}

function secondsOfRow({ readout_s, height }: CameraModel, row: number): number {
  return (readout_s * Math.min(Math.max(row, 0), height - 1)) / (height - 1);
}

type Point = [number, number, number]; // screen pixels and depth

export class Overlay {
  readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly camera = new OrthographicCamera();
  private readonly geometry = new BufferGeometry();
  private readonly positions = this.attribute("position");
  private readonly colours = this.attribute("color");
  private readonly labels: HTMLElement[] = [];
  private isClear = true; // nothing is drawn, so that the next frame without things costs nothing

  constructor(canvas: HTMLCanvasElement, private readonly labelParent: HTMLElement) {
    this.renderer = new WebGLRenderer({ canvas, alpha: true, antialias: true });
    const mesh = new Mesh(this.geometry, new MeshBasicMaterial({ vertexColors: true, side: 2 }));
    mesh.frustumCulled = false;
    this.scene.add(mesh);
  }

  resize({ width, height }: Size) {
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    // Coordinates are screen pixels, y down, and the distance as depth.
    this.camera.left = this.camera.top = 0;
    [this.camera.right, this.camera.bottom] = [width, height];
    [this.camera.near, this.camera.far] = [0, kFar_m];
    this.camera.updateProjectionMatrix();
  }

  // Draws into the canvas, or into `target`, which must be empty.
  draw(camera: CameraModel, fit: Fit, seen: Seen[], colourOf: (owner: number) => string, target?: WebGLRenderTarget) {
    if (seen.length === 0) return this.clear();
    this.isClear = false;
    let n = 0;
    for (const thing of seen) {
      const toScreen = (corner: Vector3): Point | undefined => {
        const p_cam = corner.clone().applyMatrix4(thing.T_cam_thing);
        const pixel = project(camera, p_cam);
        return pixel && [...fit.toScreen(pixel), -p_cam.z];
      };
      const colour = new Color(colourOf(thing.owner));
      n = thing.id === undefined ? this.addFrustum(toScreen, colour, n) : this.addAnchor(toScreen, colour, n);
    }
    this.geometry.setDrawRange(0, n);
    this.positions.needsUpdate = this.colours.needsUpdate = true;
    this.renderer.setRenderTarget(target ?? null);
    this.renderer.render(this.scene, this.camera);
    this.renderer.setRenderTarget(null);
    this.label(seen, fit, colourOf);
  }

  clear() {
    if (this.isClear) return;
    this.isClear = true;
    this.geometry.setDrawRange(0, 0);
    this.renderer.render(this.scene, this.camera);
    for (const label of this.labels) label.hidden = true;
  }

  private addAnchor(toScreen: (corner: Vector3) => Point | undefined, colour: Color, n: number): number {
    for (const { corners, brightness } of kAnchorFaces) {
      const points = corners.map(toScreen);
      if (!points.every((point) => point !== undefined)) continue; // partly behind the camera
      for (const point of points) this.addVertex(n++, point, colour, brightness);
    }
    return n;
  }

  // Draws lines as thin rectangles, because lines of a graphics card are only one pixel wide.
  private addFrustum(toScreen: (corner: Vector3) => Point | undefined, colour: Color, n: number): number {
    for (const edge of kFrustumEdges) {
      const [a, b] = edge.map(toScreen);
      if (!a || !b) continue;
      const length = Math.hypot(b[0] - a[0], b[1] - a[1]) || 1;
      const [x, y] = [(-kEdge_px * (b[1] - a[1])) / length / 2, (kEdge_px * (b[0] - a[0])) / length / 2];
      const at = ([u, v, depth]: Point, side: number): Point => [u + side * x, v + side * y, depth];
      for (const point of [at(a, 1), at(b, 1), at(b, -1), at(b, -1), at(a, -1), at(a, 1)]) this.addVertex(n++, point, colour, 1);
    }
    return n;
  }

  private addVertex(n: number, point: Point, colour: Color, brightness: number) {
    this.positions.setXYZ(n, ...point);
    this.colours.setXYZ(n, brightness * colour.r, brightness * colour.g, brightness * colour.b);
  }

  private label(seen: DrawnThing[], fit: Fit, colourOf: (owner: number) => string) {
    while (this.labels.length < seen.length) {
      const label = document.createElement("span");
      this.labels.push(label);
      this.labelParent.append(label);
    }
    this.labels.forEach((label, i) => {
      label.hidden = i >= seen.length;
      if (label.hidden) return;
      const { id, name, owner, pixel, distance_m } = seen[i];
      const [x, y] = fit.toScreen(pixel);
      label.textContent = `${name} · ${distance_m.toFixed(1)} m`;
      label.className = id === undefined ? "person" : "";
      label.style.setProperty("--owner", colourOf(owner));
      label.style.transform = `translate(-50%, 6px) translate(${x}px, ${y}px)`;
    });
  }

  private attribute(name: string): BufferAttribute {
    const attribute = new BufferAttribute(new Float32Array(kMaxThings * kVertices * 3), 3);
    attribute.setUsage(DynamicDrawUsage);
    this.geometry.setAttribute(name, attribute);
    return attribute;
  }
}
