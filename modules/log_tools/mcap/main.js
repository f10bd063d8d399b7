// pangea-log list LOG --json | node main.js OUT.mcap [MAP.ply...]

import { open, readFile } from "node:fs/promises";
import { convert, linesOf } from "./convert.js";

const [out, ...plys] = process.argv.slice(2);
const clouds = await Promise.all(plys.map((path) => readFile(path, "utf8")));
const file = await open(out, "wx").catch((error) => {
  console.error(`mcap: ${out}: ${error.code === "EEXIST" ? "exists; nothing is overwritten" : error.message}`);
  process.exit(1);
});
let position = 0;
const count = await convert(linesOf(process.stdin), {
  position: () => BigInt(position),
  write: async (data) => {
    await file.writeFile(data);
    position += data.byteLength;
  },
}, clouds);
await file.close();
console.log(`${out}: ${count} messages`);
