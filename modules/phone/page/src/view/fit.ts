// Maps an image's pixels to the screen and back. The image covers the view; what does not fit is cut off evenly on both sides.

export interface Size {
  width: number;
  height: number;
}

export class Fit {
  readonly scale: number; // screen pixels per image pixel
  private readonly left: number;
  private readonly top: number;

  constructor(image: Size, view: Size) {
    this.scale = Math.max(view.width / image.width, view.height / image.height);
    this.left = (view.width - this.scale * image.width) / 2;
    this.top = (view.height - this.scale * image.height) / 2;
  }

  // (0, 0) is the centre of the first pixel in the image, but the corner of the view on the screen.
  toScreen([u, v]: [number, number]): [number, number] {
    return [this.left + this.scale * (u + 0.5), this.top + this.scale * (v + 0.5)];
  }

  toPixel([x, y]: [number, number]): [number, number] {
    return [(x - this.left) / this.scale - 0.5, (y - this.top) / this.scale - 0.5];
  }
}
