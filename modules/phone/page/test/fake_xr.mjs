// A fake of WebXR for tests: an immersive-ar session with camera-access and dom-overlay, as specified. The test provides what it sees:
// window.xrSource(time_ms) gives {picture, width, height, projection, position, orientation}; while the device is lost, only
// `picture`. With window.xrBlind its views have no camera. It shows the picture behind the page, as a device does.

export function installFakeXr({ refusedFeature, frame_ms }) {
  const refuse = (name, text) => Promise.reject(new DOMException(text, name));
  const behind = document.createElement("canvas");
  behind.style.cssText = "position: fixed; inset: 0; width: 100%; height: 100%; object-fit: cover; z-index: -1";

  class Session extends EventTarget {
    renderState = {};
    callbacks = [];
    constructor(features) {
      super();
      this.features = features;
      document.documentElement.append(behind);
      this.timer = setInterval(() => this.show(), frame_ms);
    }
    async updateRenderState(state) {
      Object.assign(this.renderState, state);
    }
    async requestReferenceSpace(type) {
      return { type };
    }
    requestAnimationFrame(callback) {
      return this.callbacks.push(callback);
    }
    show() {
      const time = performance.now();
      const seen = window.xrSource?.(time);
      if (!seen || !this.renderState.baseLayer) return;
      if (seen.picture) {
        [behind.width, behind.height] = [seen.width, seen.height];
        behind.getContext("2d").drawImage(seen.picture, 0, 0);
      }
      const frame = new Frame(this, seen);
      const callbacks = this.callbacks.splice(0);
      for (const callback of callbacks) callback(time, frame);
      frame.active = false;
    }
    async end() {
      if (this.ended) return refuse("InvalidStateError", "the session has ended");
      this.ended = true;
      clearInterval(this.timer);
      behind.remove();
      this.dispatchEvent(new Event("end"));
    }
  }

  class Frame {
    active = true;
    constructor(session, seen) {
      [this.session, this.seen] = [session, seen];
    }
    getViewerPose(space) {
      if (space.type !== "local") throw new DOMException("no such space", "InvalidStateError");
      const { position, orientation, projection } = this.seen;
      if (!position) return null;
      const frame = this;
      const view = {
        eye: "none", transform: { position, orientation }, projectionMatrix: Float32Array.from(projection),
        get camera() {
          if (!frame.active) throw new DOMException("the frame is over", "InvalidStateError");
          const { width, height } = frame.seen;
          return frame.session.features.includes("camera-access") && !window.xrBlind ? { width, height, frame } : null;
        },
      };
      return { emulatedPosition: false, transform: view.transform, views: [view] };
    }
  }

  window.XRWebGLLayer = class {
    framebuffer = null; // the canvas
    constructor(session, gl) {
      if (!gl.xrCompatible) throw new DOMException("the context is not compatible", "InvalidStateError");
      [this.gl, this.framebufferWidth, this.framebufferHeight] = [gl, gl.drawingBufferWidth, gl.drawingBufferHeight];
    }
    getViewport() {
      return { x: 0, y: 0, width: this.gl.drawingBufferWidth, height: this.gl.drawingBufferHeight };
    }
  };
  window.XRWebGLBinding = class {
    constructor(_session, gl) {
      [this.gl, this.texture] = [gl, gl.createTexture()];
    }
    // The first row of the texture is the lowest one of the image. A canvas is used, because WebGL does not flip an ImageBitmap.
    getCameraImage({ frame }) {
      if (!frame.active) throw new DOMException("the frame is over", "InvalidStateError");
      const { gl } = this;
      gl.bindTexture(gl.TEXTURE_2D, this.texture);
      gl.pixelStorei(gl.UNPACK_FLIP_Y_WEBGL, true);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, behind);
      gl.pixelStorei(gl.UNPACK_FLIP_Y_WEBGL, false);
      return this.texture;
    }
  };
  WebGL2RenderingContext.prototype.makeXRCompatible = async function () {
    this.xrCompatible = true;
  };
  const xr = {
    isSessionSupported: async (mode) => mode === "immersive-ar",
    requestSession: async (mode, { requiredFeatures = [], domOverlay } = {}) => {
      if (!navigator.userActivation.isActive) return refuse("SecurityError", "not within a tap");
      if (mode !== "immersive-ar" || requiredFeatures.includes(refusedFeature)) return refuse("NotSupportedError", "no such session");
      if (requiredFeatures.includes("dom-overlay") && !domOverlay?.root) return refuse("NotSupportedError", "no overlay");
      return (window.xrSession = new Session(requiredFeatures));
    },
  };
  Object.defineProperty(navigator, "xr", { value: xr });
}

// The projection matrix of a pinhole camera whose principal point is the middle of the image; column-major, as in OpenGL.
export function projectionOf({ width, height, focal }) {
  const [near, far] = [0.1, 1000];
  return [
    (2 * focal) / width, 0, 0, 0,
    0, (2 * focal) / height, 0, 0,
    0, 0, -(far + near) / (far - near), -1,
    0, 0, (-2 * far * near) / (far - near), 0,
  ];
}
