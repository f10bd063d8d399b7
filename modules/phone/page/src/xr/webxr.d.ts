// What TypeScript's types of WebXR lack: the Raw Camera Access Module (https://immersive-web.github.io/raw-camera-access/).

export {};

// And what three.js' types lack: a framebuffer in place of a target's own.
declare module "three" {
  interface WebGLRenderer {
    setRenderTargetFramebuffer(target: import("three").WebGLRenderTarget, framebuffer: WebGLFramebuffer): void;
  }
}

declare global {
  interface XRCamera {
    readonly width: number;
    readonly height: number;
  }
  interface XRView {
    readonly camera?: XRCamera | null;
  }
  interface XRWebGLBinding {
    getCameraImage(camera: XRCamera): WebGLTexture | null;
  }
}
