// Buffers on the graphics card that grow as points and lines arrive. Data that are already there
// are not sent again.

import {
  BufferAttribute, BufferGeometry, InstancedBufferAttribute, InstancedBufferGeometry, Mesh, Points,
  ShaderMaterial,
} from "three";

type Layout = Record<string, number>; // numbers per vertex (or instance), by attribute

class Growing {
  count = 0;
  private capacity = 0;
  private arrays = new Map<string, Float32Array>();

  constructor(
    private readonly layout: Layout,
    private readonly makeGeometry: (arrays: Map<string, Float32Array>) => BufferGeometry,
    private readonly object: { geometry: BufferGeometry },
  ) {
    this.reserve(1024);
  }

  add(items: number, values: Record<string, ArrayLike<number>>) {
    if (this.count + items > this.capacity) this.reserve(2 * (this.count + items));
    for (const [name, size] of Object.entries(this.layout)) {
      this.arrays.get(name)!.set(values[name], size * this.count);
      const attribute = this.object.geometry.getAttribute(name) as BufferAttribute;
      attribute.addUpdateRange(size * this.count, size * items);
      attribute.needsUpdate = true;
    }
    this.count += items;
  }

  clear() {
    this.count = 0;
  }

  private reserve(capacity: number) {
    this.capacity = capacity;
    for (const [name, size] of Object.entries(this.layout)) {
      const array = new Float32Array(size * capacity);
      array.set(this.arrays.get(name)?.subarray(0, size * this.count) ?? []);
      this.arrays.set(name, array);
    }
    this.object.geometry.dispose();
    this.object.geometry = this.makeGeometry(this.arrays);
  }
}

export class PointCloud {
  readonly object: Points;
  private readonly growing: Growing;

  constructor(material: ShaderMaterial) {
    this.object = new Points(new BufferGeometry(), material);
    this.object.frustumCulled = false;
    this.growing = new Growing(
      { position: 3, keyframe: 1 },
      (arrays) => {
        const geometry = new BufferGeometry();
        geometry.setAttribute("position", new BufferAttribute(arrays.get("position")!, 3));
        geometry.setAttribute("keyframe", new BufferAttribute(arrays.get("keyframe")!, 1));
        return geometry;
      },
      this.object,
    );
  }

  add(keyframe: number, points: Float32Array) {
    const count = points.length / 3;
    this.growing.add(count, { position: points, keyframe: new Float32Array(count).fill(keyframe) });
    this.object.geometry.setDrawRange(0, this.growing.count);
  }

  // Calls `take` for each point, with its keyframe and its position in that keyframe's body frame.
  forEach(take: (keyframe: number, x: number, y: number, z: number) => void) {
    const { position, keyframe } = this.object.geometry.attributes;
    for (let i = 0; i < this.growing.count; ++i) {
      take(keyframe.array[i], position.array[3 * i], position.array[3 * i + 1], position.array[3 * i + 2]);
    }
  }

  clear() {
    this.growing.clear();
    this.object.geometry.setDrawRange(0, 0);
  }
}

// Straight lines between keyframes; each is a rectangle that faces the camera.
export class Lines {
  readonly object: Mesh<InstancedBufferGeometry, ShaderMaterial>;
  private readonly growing: Growing;

  constructor(material: ShaderMaterial) {
    this.object = new Mesh(new InstancedBufferGeometry(), material);
    this.object.frustumCulled = false;
    this.growing = new Growing(
      { ends: 2, style: 4 },
      (arrays) => {
        const geometry = new InstancedBufferGeometry();
        const corners = new Float32Array([0, -1, 0, 1, -1, 0, 1, 1, 0, 0, 1, 0]);
        geometry.setAttribute("position", new BufferAttribute(corners, 3));
        geometry.setIndex([0, 1, 2, 0, 2, 3]);
        geometry.setAttribute("ends", new InstancedBufferAttribute(arrays.get("ends")!, 2));
        geometry.setAttribute("style", new InstancedBufferAttribute(arrays.get("style")!, 4));
        return geometry;
      },
      this.object as unknown as { geometry: BufferGeometry },
    );
    this.object.geometry.instanceCount = 0;
  }

  add(from: number, to: number, style: ArrayLike<number>) {
    this.growing.add(1, { ends: [from, to], style });
    this.object.geometry.instanceCount = this.growing.count;
  }

  clear() {
    this.growing.clear();
    this.object.geometry.instanceCount = 0;
  }
}
