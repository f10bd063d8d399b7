// Finds what is under the pointer, and where things are on the screen, in pixels of the canvas.

import { PerspectiveCamera, Plane, Raycaster, Vector2, Vector3 } from "three";
import type { PointCloud } from "./buffers";
import { Model } from "./model";
import type { ConstraintSaid } from "./protocol";

const kHoverPixels = 8;
const kPickPixels = 12; // largest distance to a map point

export type Drawn = "points" | "accepted" | "refused" | "anchors";

export class Picking {
  constructor(
    private readonly camera: PerspectiveCamera,
    private readonly canvas: HTMLCanvasElement,
    private readonly model: Model,
    private readonly points: PointCloud,
    private readonly shows: (what: Drawn) => boolean,
  ) {}

  // The pixel of a point; undefined behind the camera.
  pixelOf(p: Vector3): Vector2 | undefined {
    const { clientWidth, clientHeight } = this.canvas;
    const at = p.clone().project(this.camera);
    if (at.z > 1) return undefined;
    return new Vector2(((at.x + 1) / 2) * clientWidth, ((1 - at.y) / 2) * clientHeight);
  }

  // The pixels of both ends of a constraint; undefined if one is behind the camera.
  onScreen(constraint: ConstraintSaid): [Vector2, Vector2] | undefined {
    const [a, b] = (this.model.ends(constraint) ?? []).map((k) => this.pixelOf(this.model.keyframes[k].shown.t));
    return a && b && [a, b];
  }

  // The drawn constraint under the pointer.
  constraintAt(x: number, y: number): ConstraintSaid | undefined {
    let best: ConstraintSaid | undefined;
    let least = kHoverPixels;
    for (const constraint of this.model.constraints) {
      if (!constraint || !this.shows(constraint.accepted ? "accepted" : "refused")) continue;
      const ends = this.onScreen(constraint);
      const distance = ends ? distanceToSegment(new Vector2(x, y), ...ends) : Infinity;
      if (distance < least) [best, least] = [constraint, distance];
    }
    return best;
  }

  anchorAt(x: number, y: number): number | undefined {
    if (!this.shows("anchors")) return undefined;
    let best: number | undefined;
    let least = kPickPixels;
    for (const index of this.model.anchors.keys()) {
      const pose = this.model.anchorPose(index);
      const distance = (pose && this.pixelOf(pose.t)?.distanceTo(new Vector2(x, y))) ?? Infinity;
      if (distance < least) [best, least] = [index, distance];
    }
    return best;
  }

  // The map point or the keyframe under the pointer, in the body frame of the keyframe that saw it.
  pick(x: number, y: number): { keyframe: number; p_body: Vector3 } | undefined {
    const { keyframes } = this.model;
    const pointer = new Vector2(x, y);
    const p = new Vector3();
    let best: { keyframe: number; p_body: Vector3 } | undefined;
    let least = kPickPixels;
    const offer = (keyframe: number, px: number, py: number, pz: number) => {
      const { t, q } = keyframes[keyframe].shown;
      p.set(px, py, pz).applyQuaternion(q).add(t);
      const distance = this.pixelOf(p)?.distanceTo(pointer) ?? Infinity;
      if (distance < least) [best, least] = [{ keyframe, p_body: new Vector3(px, py, pz) }, distance];
    };
    if (this.shows("points")) this.points.forEach(offer);
    keyframes.forEach((keyframe, k) => keyframe.arrived && offer(k, 0, 0, 0));
    return best;
  }

  // The point where the pointer's ray meets a plane.
  onPlane(x: number, y: number, point: Vector3, normal: Vector3): Vector3 | undefined {
    const { clientWidth, clientHeight } = this.canvas;
    const caster = new Raycaster();
    caster.setFromCamera(new Vector2((2 * x) / clientWidth - 1, 1 - (2 * y) / clientHeight), this.camera);
    const plane = new Plane().setFromNormalAndCoplanarPoint(normal, point);
    return caster.ray.intersectPlane(plane, new Vector3()) ?? undefined;
  }
}

function distanceToSegment(p: Vector2, a: Vector2, b: Vector2): number {
  const ab = b.clone().sub(a);
  const along = ab.lengthSq() > 0 ? p.clone().sub(a).dot(ab) / ab.lengthSq() : 0;
  return p.distanceTo(a.clone().addScaledVector(ab, Math.min(1, Math.max(0, along))));
}
