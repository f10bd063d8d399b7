// The motion of a camera with a rolling shutter while it reads an image out. The agent's pose is that of the first row; while it
// rotates at 1 rad/s, the last row of a phone's camera sees things 10 pixels from there.

import { Matrix4, Quaternion, Vector3 } from "three";
import type { PhonePose } from "../agent/phone_agent";
import type { CameraModel } from "./camera_model";
import { matrixOf } from "./poses";

const kOne = new Vector3(1, 1, 1);
const kLongest_us = 200_000; // between two poses that tell a motion

export class CameraMotion {
  private constructor(private readonly rotation_radps: Vector3, private readonly velocity_mps: Vector3) {} // in the camera frame

  // From the poses of two images in succession; undefined if they tell none.
  static between(before: PhonePose | undefined, now: PhonePose, { T_body_cam }: CameraModel): CameraMotion | undefined {
    const duration_us = now.utime - (before?.utime ?? now.utime);
    if (!before || before.map !== now.map || before.state !== "tracking" || duration_us <= 0 || duration_us > kLongest_us) return undefined;
    const T_odom_before = matrixOf(before.T_odom_body).multiply(T_body_cam);
    const T_before_now = T_odom_before.invert().multiply(matrixOf(now.T_odom_body)).multiply(T_body_cam);
    const [translation, q] = [new Vector3(), new Quaternion()];
    T_before_now.decompose(translation, q, new Vector3());
    const perSecond = 1e6 / duration_us;
    const axis = new Vector3(q.x, q.y, q.z).multiplyScalar(q.w < 0 ? -1 : 1);
    const sine = axis.length();
    const angle = 2 * Math.atan2(sine, Math.abs(q.w));
    return new CameraMotion(axis.multiplyScalar(sine > 0 ? (angle / sine) * perSecond : 0), translation.multiplyScalar(perSecond));
  }

  // T_later_now: from the camera frame of the first row to that of `seconds` later.
  after(seconds: number): Matrix4 {
    const angle = this.rotation_radps.length() * seconds;
    const rotation = new Quaternion().setFromAxisAngle(this.rotation_radps.clone().normalize(), angle);
    return new Matrix4().compose(this.velocity_mps.clone().multiplyScalar(seconds), rotation, kOne).invert();
  }
}
