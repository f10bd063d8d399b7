// Shows the view of the chosen agent's camera at its newest keyframe: its tracks, on the image if there is one.

import { agentColour } from "../../../web/page/palette";
import { byId } from "./panels";
import type { ViewSaid } from "./protocol";

const kRaw = 1; // image_t.ENCODING_RAW8; PNG is 2

async function bitmapOf(view: ViewSaid): Promise<ImageBitmap | undefined> {
  if (view.image.length === 0) return undefined;
  if (view.encoding !== kRaw) return createImageBitmap(new Blob([view.image.slice()]));
  const pixels = new ImageData(view.width, view.height);
  for (let i = 0; i < view.image.length; ++i) {
    pixels.data.fill(view.image[i], 4 * i, 4 * i + 3);
    pixels.data[4 * i + 3] = 255;
  }
  return createImageBitmap(pixels);
}

let numBegun = 0;
let newestDrawn = 0; // its number

export async function drawView(view: ViewSaid) {
  byId("view").hidden = false;
  const number = ++numBegun;
  const image = await bitmapOf(view).catch(() => undefined);
  // Images may be decoded in another order than they came.
  if (number > newestDrawn) {
    newestDrawn = number;
    draw(view, image);
  }
  image?.close();
}

function draw(view: ViewSaid, image: ImageBitmap | undefined) {
  const canvas = byId<HTMLCanvasElement>("view_canvas");
  canvas.width = view.width;
  canvas.height = view.height;
  const context = canvas.getContext("2d")!;
  context.fillStyle = "#20242b";
  context.fillRect(0, 0, canvas.width, canvas.height);
  if (image) context.drawImage(image, 0, 0, canvas.width, canvas.height);
  // The panel is small, so the widths of strokes are in its pixels.
  const scale = canvas.width / canvas.clientWidth || 1;
  const colour = agentColour(view.agent);
  for (const [width, stroke] of [[2.5, "rgb(0 0 0 / 60%)"], [1.2, colour]] as const) {
    context.lineWidth = width * scale;
    context.strokeStyle = context.fillStyle = stroke;
    for (const track of view.tracks) {
      context.beginPath();
      for (let i = 0; i < track.length; i += 2) context.lineTo(track[i], track[i + 1]);
      context.stroke();
      context.beginPath();
      context.arc(track[0], track[1], (width + 0.8) * scale, 0, 2 * Math.PI);
      context.fill();
    }
  }
  byId("view_caption").textContent =
    `Agent ${view.agent}, newest keyframe: ${view.tracks.length} tracks` +
    (image ? "" : " (no images on this bus)");
}
