// The shape of a drawn anchor: a diamond that stands on it. It has a fixed size in metres, so that it looks near or far. In the
// anchor's frame, metres, z up.

import { Vector3 } from "three";

const kHeight = 0.24;
const kRadius = 0.06;
const kLight = new Vector3(0.4, 0.3, 0.85).normalize();

interface Face {
  corners: [Vector3, Vector3, Vector3];
  brightness: number; // 0 to 1
}

function makeFaces(): Face[] {
  const [foot, top] = [new Vector3(), new Vector3(0, 0, kHeight)];
  const girdle = [0, 1, 2, 3].map((i) => {
    const angle = (i * Math.PI) / 2;
    return new Vector3(kRadius * Math.cos(angle), kRadius * Math.sin(angle), 0.65 * kHeight);
  });
  return girdle.flatMap((a, i) => {
    const b = girdle[(i + 1) % 4];
    return [[a, b, top], [b, a, foot]].map(([p, q, r]) => {
      const normal = q.clone().sub(p).cross(r.clone().sub(p)).normalize();
      return { corners: [p, q, r] as Face["corners"], brightness: 0.65 + 0.35 * normal.dot(kLight) };
    });
  });
}

export const kAnchorFaces = makeFaces();
