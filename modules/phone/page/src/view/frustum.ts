// The shape of another person's camera: the edges of a small frustum, with a mark on its upper side. In the camera's frame, metres: z
// forward, x right, y down.

import { Vector3 } from "three";

const kDepth = 0.24;
const kHalfWidth = 0.16;
const kHalfHeight = 0.12;
const kMark = 0.08;

type Edge = [Vector3, Vector3];

function makeEdges(): Edge[] {
  const eye = new Vector3();
  const at = (x: number, y: number) => new Vector3(x, y, kDepth);
  const base = [at(-kHalfWidth, -kHalfHeight), at(kHalfWidth, -kHalfHeight), at(kHalfWidth, kHalfHeight), at(-kHalfWidth, kHalfHeight)];
  const mark = [at(-kMark, -kHalfHeight - 0.02), at(0, -kHalfHeight - 0.02 - kMark), at(kMark, -kHalfHeight - 0.02)];
  const closed = (corners: Vector3[]) => corners.map((a, i): Edge => [a, corners[(i + 1) % corners.length]]);
  return [...base.map((corner): Edge => [eye, corner]), ...closed(base), ...closed(mark)];
}

export const kFrustumEdges = makeEdges();
