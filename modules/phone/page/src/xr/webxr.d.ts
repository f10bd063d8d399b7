// Types that TypeScript's WebXR types lack: the Raw Camera Access Module (https://immersive-web.github.io/raw-camera-access/).

export {};

// A function that the types of three.js lack: it replaces a target's own framebuffer.
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
