// Compares where a page shows the other page's camera with the true pose in the rendered hall of both recordings.

import { Matrix4, Quaternion, Vector3 } from "three";
import { check } from "../../../viewer/page/test/harness.mjs";

const kMaxError_m = 0.5; // a walk of half a second

const matrixOf = ([x, y, z, qx, qy, qz, qw]) => new Matrix4().compose(new Vector3(x, y, z), new Quaternion(qx, qy, qz, qw), new Vector3(1, 1, 1));

// Records some times per second the pose of the page's own body and of the others' cameras.
export const noteOthers = (page) => page.evaluate(() => {
  window.notedOthers = [];
  setInterval(() => {
    const { walk } = pangea;
    if (walk?.pose?.state !== "tracking") return;
    const { utime, map, T_odom_body } = walk.pose;
    notedOthers.push({ wall: performance.timeOrigin + performance.now(), utime, T_odom_body, others: walk.others.in(map, performance.now()) });
  }, 200);
});

// `a` and `b`: {page, truth, agent, camera, timeOf}. `timeOf` converts an image's time to the truth's; without it they are equal. Compares
// b as a shows it with the true pose of b's own image at the same time.
export async function checkOther(a, b) {
  const cameraAt = ({ truth, timeOf = (utime) => utime }, utime) => timeOf(utime) && truth.cameraAt(timeOf(utime));
  const [ofA, ofB] = await Promise.all([a, b].map(({ page }) => page.evaluate(() => notedOthers)));
  const errors = [];
  for (const { wall, utime, T_odom_body, others } of ofA) {
    const shown = others.find(({ agent }) => agent === b.agent);
    const its = ofB.findLast((note) => note.wall <= wall);
    if (!shown || !its || wall - its.wall > 500) continue;
    const inOdom = matrixOf(T_odom_body).multiply(a.camera ?? a.truth.camera.T_body_cam).invert().multiply(matrixOf(shown.T_odom_cam));
    const [from, to] = [cameraAt(a, utime), cameraAt(b, its.utime)];
    if (!from || !to) continue;
    const inHall = from.invert().multiply(to);
    errors.push(new Vector3().setFromMatrixPosition(inOdom).distanceTo(new Vector3().setFromMatrixPosition(inHall)));
  }
  errors.sort((x, y) => x - y);
  const median = errors[errors.length >> 1];
  check("it shows the other where the other is", errors.length > 20 && median < kMaxError_m,
    `${errors.length} times: median ${median?.toFixed(2)}, largest ${errors.at(-1)?.toFixed(2)} m`);
}
