// Converts the agent's poses (seven numbers) to matrices.

import { Matrix4, Quaternion, Vector3 } from "three";
import type { Pose7 } from "../agent/phone_agent";

const kOne = new Vector3(1, 1, 1);

// T_a_b: takes coordinates in b to a.
export function matrixOf([x, y, z, qx, qy, qz, qw]: Pose7): Matrix4 {
  return new Matrix4().compose(new Vector3(x, y, z), new Quaternion(qx, qy, qz, qw), kOne);
}
