import { Truth } from "./truth.mjs";
const t = new Truth(process.argv[2]);
const byId = new Map();
for (const [utime, points] of t.tracks()) for (const { id, pixel } of points) { if (!byId.has(id)) byId.set(id, []); byId.get(id).push({ utime, pixel }); }
let n = 0, worst = 0;
for (const [id, obs] of byId) { if (obs.length < 30) continue; const p = t.triangulate(obs); let m = 0; for (const { utime, pixel } of obs) { const q = t.pixelOf(p, utime); if (q) m = Math.max(m, Math.hypot(q[0]-pixel[0], q[1]-pixel[1])); } worst = Math.max(worst, m); if (++n > 30) break; }
console.log(n, "landmarks, worst reprojection", worst);
