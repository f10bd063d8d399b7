// A map of the path from above, with the anchors and the others. It is in the odom frame, so that nothing jumps.

import { Matrix4, Vector3 } from "three";
import type { PhonePose, OtherAgent, DrawnAnchor } from "../agent/phone_agent";
import { matrixOf } from "../view/poses";

const kStep_m = 0.1; // distance between points of the path that are kept
const kMaxPoints = 3000;
const kSmallest_m = 4; // smallest width of the map
const kSelf = 22; // size, pixels of the canvas
const kOther = 16;

export class SmallMap {
  private way: { x: number; y: number }[] = [];
  private map = "";

  constructor(private readonly canvas: HTMLCanvasElement) {}

  // `T_body_cam` gives the direction of the camera.
  draw(
    pose: PhonePose, T_body_cam: Matrix4, anchors: DrawnAnchor[], others: OtherAgent[], colourOf: (owner: number) => string, self: number,
  ) {
    this.add(pose);
    const things = [...anchors.map(({ T_odom_anchor }) => T_odom_anchor), ...others.map(({ T_odom_cam }) => T_odom_cam)];
    const points = [...this.way, ...things.map(([x, y]) => ({ x, y }))];
    const place = this.placing(points);
    const context = this.canvas.getContext("2d")!;
    context.clearRect(0, 0, this.canvas.width, this.canvas.height);
    context.lineWidth = 3;
    context.lineJoin = "round";
    context.strokeStyle = context.fillStyle = colourOf(self);
    context.beginPath();
    for (const p of this.way) context.lineTo(...place(p));
    context.stroke();
    drawCamera(context, matrixOf(pose.T_odom_body).multiply(T_body_cam), place, kSelf);
    for (const { agent, T_odom_cam } of others) {
      context.fillStyle = colourOf(agent);
      drawCamera(context, matrixOf(T_odom_cam), place, kOther);
    }
    for (const { owner, T_odom_anchor: [x, y] } of anchors) {
      const [u, v] = place({ x, y });
      context.fillStyle = colourOf(owner);
      context.fillRect(u - 4, v - 4, 8, 8);
    }
  }

  private add({ map, state, T_odom_body: [x, y] }: PhonePose) {
    if (map !== this.map) this.way = [];
    this.map = map;
    const last = this.way.at(-1);
    if (state !== "tracking" || (last && Math.hypot(x - last.x, y - last.y) < kStep_m)) return;
    this.way.push({ x, y });
    if (this.way.length > kMaxPoints) this.way.shift();
  }

  private placing(points: { x: number; y: number }[]) {
    const xs = points.map(({ x }) => x);
    const ys = points.map(({ y }) => y);
    const [west, east, south, north] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
    const scale = (0.85 * this.canvas.width) / Math.max(east - west, north - south, kSmallest_m);
    return ({ x, y }: { x: number; y: number }): [number, number] => [
      this.canvas.width / 2 + scale * (x - (west + east) / 2),
      this.canvas.height / 2 - scale * (y - (south + north) / 2),
    ];
  }
}

// Draws the position and viewing direction of somebody.
function drawCamera(
  context: CanvasRenderingContext2D, T_odom_cam: Matrix4, place: (p: { x: number; y: number }) => [number, number], radius: number,
) {
  const { x, y } = new Vector3().setFromMatrixPosition(T_odom_cam);
  const ahead = new Vector3(0, 0, 1).transformDirection(T_odom_cam);
  const heading = Math.atan2(-ahead.y, ahead.x);
  const [u, v] = place({ x, y });
  context.beginPath();
  context.moveTo(u, v);
  context.arc(u, v, radius, heading - 0.45, heading + 0.45);
  context.fill();
}
