// Converts WebXR's frames and matrices to ours. Body is WebXR's view: x to the right of the screen, y to its top, z out of it. WebXR's
// space has y up, our odom frame has z up (docs/anchors.md).

import type { Pose7 } from "../agent/phone_agent";
import type { Size } from "../view/fit";

// T_odom_body from the transform of a view.
export function odomPose({ position: p, orientation: q }: Pick<XRRigidTransform, "position" | "orientation">): Pose7 {
  // R_odom_xr = [0 0 -1; -1 0 0; 0 1 0], as a quaternion (x, y, z, w) = (1, -1, -1, 1) / 2.
  const [x, y, z, w] = [0.5, -0.5, -0.5, 0.5];
  return [
    -p.z, -p.x, p.y,
    w * q.x + x * q.w + y * q.z - z * q.y,
    w * q.y - x * q.z + y * q.w + z * q.x,
    w * q.z + x * q.y - y * q.x + z * q.w,
    w * q.w - x * q.x - y * q.y - z * q.z,
  ];
}

// The calibration as the text of a cam0/sensor.yaml. The camera's image has the frustum of its view, so the view's projection matrix
// (column-major, as in OpenGL) gives the intrinsics. WebXR does not give lens distortion.
export function cameraYamlOf(projection: ArrayLike<number>, { width, height }: Size): string {
  const focal = [(width / 2) * projection[0], (height / 2) * projection[5]];
  const centre = [(width / 2) * (1 - projection[8]) - 0.5, (height / 2) * (1 + projection[9]) - 0.5];
  return `sensor_type: camera
comment: of the device's own odometry, by WebXR
T_BS:
  cols: 4
  rows: 4
  data: [1, 0, 0, 0,
         0, -1, 0, 0,
         0, 0, -1, 0,
         0, 0, 0, 1]
resolution: [${width}, ${height}]
camera_model: pinhole
intrinsics: [${[...focal, ...centre].map((value) => value.toFixed(3)).join(", ")}]
distortion_model: radial-tangential
distortion_coefficients: [0, 0, 0, 0]
`;
}
