// The ground truth of a rendered recording: exact poses of the body, and exact tracks of the scene's points.

import { readdirSync, readFileSync } from "node:fs";
import { Matrix3, Matrix4, Quaternion, Vector3 } from "three";
import { parseCamera, project } from "../src/view/camera_model";

const rows = (file) => readFileSync(file, "utf8").split("\n").filter((line) => line && !line.startsWith("#")).map((line) => line.split(","));
const utimeOf = (nanoseconds) => Number(nanoseconds.slice(0, -3));

export class Truth {
  constructor(recording) {
    this.camera = parseCamera(readFileSync(`${recording}/mav0/cam0/sensor.yaml`, "utf8"), "cam0/sensor.yaml");
    this.readout_us = 12_000; // of pangea-sim's phone
    this.poses = rows(`${recording}/mav0/state_groundtruth_estimate0/data.csv`).map(([stamp, ...row]) => {
      const [x, y, z, qw, qx, qy, qz] = row.map(Number);
      return { utime: utimeOf(stamp), p: new Vector3(x, y, z), q: new Quaternion(qx, qy, qz, qw) };
    });
    this.recording = recording;
  }

  // The time stamps of the images.
  images() {
    return readdirSync(`${this.recording}/mav0/cam0/data`).filter((name) => name.endsWith(".png")).sort().map((name) => utimeOf(name.slice(0, -4)));
  }

  // The pixel of a point of the camera frame.
  project(p_cam) {
    return project(this.camera, p_cam);
  }

  // T_world_cam at a time, interpolated between the two poses around it.
  cameraAt(utime) {
    const { poses } = this;
    let i = poses.findIndex((pose) => pose.utime > utime);
    i = Math.min(Math.max(i, 1), poses.length - 1);
    const [a, b] = [poses[i - 1], poses[i]];
    const share = (utime - a.utime) / (b.utime - a.utime);
    const p = a.p.clone().lerp(b.p, share);
    return new Matrix4().compose(p, a.q.clone().slerp(b.q, share), new Vector3(1, 1, 1)).multiply(this.camera.T_body_cam);
  }

  // The pixel of a point of the world in the rolling-shutter image stamped `utime`; undefined if it is not visible.
  pixelOf(p_world, utime) {
    let pixel;
    let row = this.camera.height / 2;
    for (let i = 0; i < 3; ++i) {
      const time = utime + (row / (this.camera.height - 1)) * this.readout_us;
      const p_cam = p_world.clone().applyMatrix4(this.cameraAt(time).invert());
      pixel = project(this.camera, p_cam);
      if (!pixel || p_cam.z < 0.3) return undefined;
      row = pixel[1];
    }
    const [u, v] = pixel;
    return u >= 0 && v >= 0 && u < this.camera.width && v < this.camera.height ? pixel : undefined;
  }

  // The ray in the world through a pixel of the image stamped `utime`.
  rayOf([u, v], utime) {
    const [fx, fy] = this.camera.intrinsics;
    const ray = new Vector3(0, 0, 1);
    for (let i = 0; i < 30; ++i) {
      const [pu, pv] = project(this.camera, ray);
      ray.x += (u - pu) / fx;
      ray.y += (v - pv) / fy;
    }
    const T_world_cam = this.cameraAt(utime + (v / (this.camera.height - 1)) * this.readout_us);
    return { from: new Vector3().setFromMatrixPosition(T_world_cam), direction: ray.transformDirection(T_world_cam) };
  }

  // The point nearest to all rays.
  triangulate(observations) {
    const sum = new Matrix3().multiplyScalar(0);
    const right = new Vector3();
    for (const { utime, pixel } of observations) {
      const { from, direction: d } = this.rayOf(pixel, utime);
      const across = new Matrix3().set(
        1 - d.x * d.x, -d.x * d.y, -d.x * d.z, -d.y * d.x, 1 - d.y * d.y, -d.y * d.z, -d.z * d.x, -d.z * d.y, 1 - d.z * d.z);
      sum.elements.forEach((value, i) => (sum.elements[i] = value + across.elements[i]));
      right.add(from.applyMatrix3(across));
    }
    return right.applyMatrix3(sum.invert());
  }

  // The exact tracks by image: ids of points of the scene, with their pixels.
  tracks() {
    const byImage = new Map();
    for (const [stamp, id, u, v] of rows(`${this.recording}/mav0/cam0/tracks.csv`)) {
      const utime = utimeOf(stamp);
      if (!byImage.has(utime)) byImage.set(utime, []);
      byImage.get(utime).push({ id, pixel: [Number(u), Number(v)] });
    }
    return byImage;
  }
}
