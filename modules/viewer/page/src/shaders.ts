// The graphics card places everything that belongs to a keyframe. The poses of all keyframes are in one texture, and a
// vertex has the index of its keyframe. So when an optimisation moves a map, only three texels per keyframe change, and
// no points or lines.

import { DataTexture, FloatType, NearestFilter, RGBAFormat, ShaderMaterial } from "three";
import type { Color, Vector2 } from "three";
import type { Pose } from "./model";

const kPerRow = 256; // keyframes in a row of the texture
const kNumbers = 12; // per keyframe: three texels

const lookUp = /* glsl */ `
  uniform highp sampler2D poses;
  vec4 texel(float keyframe, int i) {
    int k = int(keyframe + 0.5);
    return texelFetch(poses, ivec2(3 * (k % ${kPerRow}) + i, k / ${kPerRow}), 0);
  }
  vec3 place(float keyframe, vec3 p) {
    vec4 t = texel(keyframe, 0);
    vec4 q = texel(keyframe, 1);
    return t.xyz + p + 2.0 * cross(q.xyz, cross(q.xyz, p) + q.w * p);
  }
`;

// The texels of a keyframe: (t, 1 if it is there), q, (colour, 0).
export class PoseTexture {
  readonly uniform: { value: DataTexture };
  private data = new Float32Array(0);
  private whole = true; // the whole texture must be sent to the graphics card
  private readonly changed = new Map<number, { start: number; count: number }>(); // ranges to be sent, by row

  constructor() {
    this.uniform = { value: this.make(1) };
  }

  private make(rows: number): DataTexture {
    const data = new Float32Array(kPerRow * kNumbers * rows);
    data.set(this.data);
    this.data = data;
    this.whole = true;
    this.changed.clear();
    const texture = new DataTexture(data, kPerRow * 3, rows, RGBAFormat, FloatType);
    texture.minFilter = texture.magFilter = NearestFilter;
    texture.needsUpdate = true;
    texture.onUpdate = () => this.sent();
    return texture;
  }

  private sent() {
    this.whole = false;
    this.changed.clear();
  }

  clear() {
    this.data.fill(0);
    this.whole = true;
    this.changed.clear();
    this.uniform.value.clearUpdateRanges();
    this.uniform.value.needsUpdate = true;
  }

  set(keyframe: number, { t, q }: Pose, colour: Color) {
    const row = Math.floor(keyframe / kPerRow);
    if (row >= this.uniform.value.image.height) {
      this.uniform.value.dispose();
      this.uniform.value = this.make(2 * (row + 1));
    }
    const { data } = this;
    let at = kNumbers * keyframe;
    data[at++] = t.x, data[at++] = t.y, data[at++] = t.z, data[at++] = 1;
    data[at++] = q.x, data[at++] = q.y, data[at++] = q.z, data[at++] = q.w;
    data[at++] = colour.r, data[at++] = colour.g, data[at++] = colour.b;
    if (!this.whole) this.send(keyframe, row);
    this.uniform.value.needsUpdate = true;
  }

  // Marks a keyframe to be sent. Each row is sent from its first changed keyframe to its last one.
  private send(keyframe: number, row: number) {
    const start = kNumbers * keyframe;
    const range = this.changed.get(row);
    if (!range) {
      const texture = this.uniform.value;
      texture.addUpdateRange(start, kNumbers);
      this.changed.set(row, texture.updateRanges.at(-1)!);
      return;
    }
    const end = Math.max(range.start + range.count, start + kNumbers);
    range.start = Math.min(range.start, start);
    range.count = end - range.start;
  }
}

type Poses = PoseTexture["uniform"];

export const pointMaterial = (poses: Poses, size: { value: number }) =>
  new ShaderMaterial({
    uniforms: { poses, size },
    vertexShader: /* glsl */ `
      ${lookUp}
      uniform float size;
      in float keyframe;
      out vec3 colour;
      void main() {
        colour = texel(keyframe, 2).rgb;
        vec4 eye = viewMatrix * vec4(place(keyframe, position), 1.0);
        gl_Position = projectionMatrix * eye;
        gl_PointSize = clamp(size * 28.0 / -eye.z, 0.9 * size, 2.5 * size);
      }`,
    fragmentShader: /* glsl */ `
      precision mediump float;
      in vec3 colour;
      void main() {
        vec2 off = gl_PointCoord - 0.5;
        if (dot(off, off) > 0.25) discard;
        gl_FragColor = vec4(colour, 1.0);
        #include <colorspace_fragment>
      }`,
  });

// Lines between two keyframes with a width in pixels, dashed if `dash` is not 0. If red is negative, the line has the
// first keyframe's colour. Points never hide lines: among 100 000 points nothing would be left of a line.
export const lineMaterial = (
  poses: Poses, screen: { value: Vector2 }, width: number, opacity: number,
) =>
  new ShaderMaterial({
    uniforms: { poses, screen, width: { value: width }, opacity: { value: opacity } },
    transparent: true,
    depthTest: false,
    depthWrite: false,
    vertexShader: /* glsl */ `
      ${lookUp}
      uniform vec2 screen;
      uniform float width;
      in vec2 ends;
      in vec4 style;  // colour, dash length in pixels
      out vec3 colour;
      out float along;
      flat out float dash;
      void main() {
        float there = texel(ends.x, 0).w * texel(ends.y, 0).w;
        vec4 a = projectionMatrix * viewMatrix * vec4(place(ends.x, vec3(0.0)), 1.0);
        vec4 b = projectionMatrix * viewMatrix * vec4(place(ends.y, vec3(0.0)), 1.0);
        // A line that begins behind the eye is cut at the near plane.
        float near = 0.01;
        if (there < 0.5 || (a.w < near && b.w < near)) { gl_Position = vec4(2.0, 2.0, 2.0, 1.0); return; }
        if (a.w < near) a = mix(b, a, (b.w - near) / (b.w - a.w));
        if (b.w < near) b = mix(a, b, (a.w - near) / (a.w - b.w));
        vec2 pa = a.xy / a.w * screen * 0.5;
        vec2 pb = b.xy / b.w * screen * 0.5;
        vec2 along2 = pb - pa;
        float length2 = max(length(along2), 1e-3);
        vec2 side = vec2(-along2.y, along2.x) / length2;
        vec4 end = position.x < 0.5 ? a : b;
        end.xy += side * position.y * width / screen * end.w;
        gl_Position = end;
        colour = style.r < 0.0 ? texel(ends.x, 2).rgb : style.rgb;
        along = position.x * length2;
        dash = style.a;
      }`,
    fragmentShader: /* glsl */ `
      precision mediump float;
      uniform float opacity;
      in vec3 colour;
      in float along;
      flat in float dash;
      void main() {
        if (dash > 0.0 && mod(along, 2.0 * dash) > dash) discard;
        gl_FragColor = vec4(colour, opacity);
        #include <colorspace_fragment>
      }`,
  });
