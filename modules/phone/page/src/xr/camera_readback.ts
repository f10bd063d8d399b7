// Reads the camera's texture from the graphics card as a grey image. The card makes it grey, smaller and upright, and packs four pixels
// into one. It is fetched frames later, when the card is done, so that nothing waits for it.

import type { Size } from "../view/fit";

const kPixels = 640 * 480; // approximate size of the grey image, with the camera's aspect ratio

const kVertexShader = `#version 300 es
void main() {
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  gl_Position = vec4(4.0 * corner - 1.0, 0.0, 1.0);
}`;

// Grey by BT.601 in 256ths, as in sensors/luma.ts. The texture's first row is the lowest one of the image.
const kFragmentShader = `#version 300 es
precision highp float;
uniform sampler2D image;
uniform vec2 size; // of the grey image
uniform int taps; // across one of its pixels
out vec4 four;
float grey(vec2 pixel) {
  vec3 sum = vec3(0.0);
  for (int y = 0; y < taps; ++y) {
    for (int x = 0; x < taps; ++x) {
      vec2 at = (pixel + (vec2(x, y) + 0.5) / float(taps)) / size;
      sum += texture(image, vec2(at.x, 1.0 - at.y)).rgb;
    }
  }
  return dot(sum, vec3(77.0, 150.0, 29.0)) / (256.0 * float(taps * taps));
}
void main() {
  vec2 pixel = floor(gl_FragCoord.xy) * vec2(4.0, 1.0);
  four = vec4(grey(pixel), grey(pixel + vec2(1.0, 0.0)), grey(pixel + vec2(2.0, 0.0)), grey(pixel + vec2(3.0, 0.0)));
}`;

// The size of the grey image. Its width is a multiple of four.
export function greySizeOf({ width, height }: Size): Size {
  const scale = Math.min(1, Math.sqrt(kPixels / (width * height)));
  return { width: Math.max(4, 4 * Math.round((scale * width) / 4)), height: Math.max(1, Math.round(scale * height)) };
}

export class CameraReadback {
  private readonly program: WebGLProgram;
  private readonly sampler: WebGLSampler;
  private readonly vertices: WebGLVertexArrayObject;
  private readonly framebuffer: WebGLFramebuffer;
  private readonly grey: WebGLTexture;
  private readonly buffer: WebGLBuffer;
  private pending?: { done: WebGLSync; size: Size };

  constructor(private readonly gl: WebGL2RenderingContext) {
    this.program = makeProgram(gl);
    this.sampler = gl.createSampler()!;
    for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.samplerParameteri(this.sampler, filter, gl.LINEAR);
    for (const wrap of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.samplerParameteri(this.sampler, wrap, gl.CLAMP_TO_EDGE);
    this.vertices = gl.createVertexArray()!;
    this.framebuffer = gl.createFramebuffer()!;
    this.grey = gl.createTexture()!;
    this.buffer = gl.createBuffer()!;
  }

  get isBusy(): boolean {
    return this.pending !== undefined;
  }

  // Starts reading an image. It changes the state of the WebGL context, which the owner must reset afterwards.
  start(texture: WebGLTexture, camera: Size) {
    const { gl } = this;
    const size = greySizeOf(camera);
    const packed = size.width / 4;
    gl.bindTexture(gl.TEXTURE_2D, this.grey);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, packed, size.height, 0, gl.RGBA, gl.UNSIGNED_BYTE, null);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.framebuffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.grey, 0);
    gl.viewport(0, 0, packed, size.height);
    for (const test of [gl.BLEND, gl.CULL_FACE, gl.DEPTH_TEST, gl.SCISSOR_TEST, gl.STENCIL_TEST]) gl.disable(test);
    gl.colorMask(true, true, true, true);
    gl.useProgram(this.program);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.bindSampler(0, this.sampler);
    gl.uniform1i(gl.getUniformLocation(this.program, "image"), 0);
    gl.uniform2f(gl.getUniformLocation(this.program, "size"), size.width, size.height);
    gl.uniform1i(gl.getUniformLocation(this.program, "taps"), Math.max(1, Math.round(camera.width / size.width)));
    gl.bindVertexArray(this.vertices);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.bindBuffer(gl.PIXEL_PACK_BUFFER, this.buffer);
    gl.bufferData(gl.PIXEL_PACK_BUFFER, size.width * size.height, gl.STREAM_READ);
    gl.readPixels(0, 0, packed, size.height, gl.RGBA, gl.UNSIGNED_BYTE, 0);
    const done = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.bindBuffer(gl.PIXEL_PACK_BUFFER, null);
    gl.bindSampler(0, null);
    gl.bindVertexArray(null);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.flush();
    if (done) this.pending = { done, size };
  }

  // Returns the started image once, when it is ready.
  take(): { luma: Uint8Array; size: Size } | undefined {
    const { gl, pending } = this;
    if (!pending || gl.clientWaitSync(pending.done, 0, 0) === gl.TIMEOUT_EXPIRED) return undefined;
    this.pending = undefined;
    gl.deleteSync(pending.done);
    const luma = new Uint8Array(pending.size.width * pending.size.height);
    gl.bindBuffer(gl.PIXEL_PACK_BUFFER, this.buffer);
    gl.getBufferSubData(gl.PIXEL_PACK_BUFFER, 0, luma);
    gl.bindBuffer(gl.PIXEL_PACK_BUFFER, null);
    return { luma, size: pending.size };
  }

  // Frees what it has on the graphics card; it must not be used any more.
  dispose() {
    const { gl } = this;
    if (this.pending) gl.deleteSync(this.pending.done);
    this.pending = undefined;
    gl.deleteProgram(this.program);
    gl.deleteSampler(this.sampler);
    gl.deleteVertexArray(this.vertices);
    gl.deleteFramebuffer(this.framebuffer);
    gl.deleteTexture(this.grey);
    gl.deleteBuffer(this.buffer);
  }
}

function makeProgram(gl: WebGL2RenderingContext): WebGLProgram {
  const program = gl.createProgram()!;
  for (const [type, source] of [[gl.VERTEX_SHADER, kVertexShader], [gl.FRAGMENT_SHADER, kFragmentShader]] as const) {
    const shader = gl.createShader(type)!;
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
    gl.deleteShader(shader); // when the program is deleted
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(`camera's shader: ${gl.getProgramInfoLog(program)}`);
  return program;
}
