// pangea-log list LOG --json | node main.js OUT.mcap

import { open } from "node:fs/promises";
import { convert, linesOf } from "./convert.js";

const [out] = process.argv.slice(2);
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
});
await file.close();
console.log(`${out}: ${count} messages`);
