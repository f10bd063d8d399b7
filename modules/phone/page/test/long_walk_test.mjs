// Plays five minutes of walking at twice the speed, with the agent in Node and a real server, over TLS. The agent's heap must stay
// small, and the server must get every keyframe.

import { spawn } from "node:child_process";
import { check, options, run } from "../../../viewer/page/test/harness.mjs";
import { recording } from "./pair.mjs";
import { Server } from "./server.mjs";

const kMaxHeap_MB = 64;

// Runs the agent and returns its output.
function played(server, { agent, key }, folder) {
  const said = [`${options.wasm}/pangea-agent.mjs`, "--agent", agent, "--key", key, "--gateway", `wss://localhost:${server.port}`, "--recording", folder, "--rate", 2];
  const env = { ...process.env, NODE_EXTRA_CA_CERTS: `${server.site}/gateway/ca.pem` };
  const child = spawn("node", said.map(String), { env, stdio: ["ignore", "inherit", "pipe"] });
  let summary = "";
  child.stderr.on("data", (text) => (summary += text));
  return new Promise((done) => child.on("exit", () => done(summary.trim())));
}

await run(async () => {
  const server = new Server();
  await server.start();
  const summary = await played(server, await server.makeAgent(7), recording("long"));
  console.log(`       ${summary}`);
  const [, images, unacknowledged, heap_MB] = /(\d+) images.* (\d+) not acknowledged.* heap ([\d.]+) MB/.exec(summary) ?? [];
  check("all of it is played, and the server has every keyframe", images >= 6000 && unacknowledged === "0");
  check(`the heap is at most ${kMaxHeap_MB} MB`, heap_MB <= kMaxHeap_MB, heap_MB);
});
