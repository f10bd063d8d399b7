// A server with a gateway on its own site, and a browser that trusts only this gateway's certificate.

import { execFileSync } from "node:child_process";
import { createHash, X509Certificate } from "node:crypto";
import { existsSync, mkdtempSync, readFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { connect } from "node:net";
import { launch, options, start } from "../../../viewer/page/test/harness.mjs";

const kNewKey_ms = 3000; // until the gateway has looked into keys/, once a second

const pause = (ms) => new Promise((done) => setTimeout(done, ms));

async function until(what, condition, timeout_ms = 30_000) {
  for (const began = Date.now(); !(await condition()); await pause(100)) {
    if (Date.now() - began > timeout_ms) throw new Error(`${what} took more than ${timeout_ms / 1000} s`);
  }
}

const answers = (port) => new Promise((done) => {
  const socket = connect(port, "127.0.0.1", () => (socket.destroy(), done(true)));
  socket.on("error", () => done(false));
});

const bus = (port) => `udpm://239.255.76.67:${port}?ttl=0&recv_buf_size=4194304`;

export class Server {
  constructor() {
    this.site = `${mkdtempSync(`${tmpdir()}/pangea_phones_`)}/hall`;
    const base = 20_000 + 4 * (process.pid % 8000);
    [this.bus, this.link, this.agentBus, this.port] = [bus(base), bus(base + 1), bus(base + 2), base + 3];
  }

  async start() {
    this.run("pangea-server", "--site", this.site, "--bus", this.bus, "--link", this.link);
    await until("the site", () => existsSync(`${this.site}/site.yaml`) && existsSync(`${this.site}/keys`));
    this.run("pangea-gateway", "--site", this.site, "--bus", this.bus, "--link", this.link, "--listen", "127.0.0.1", "--port", String(this.port), "--host", "localhost", "--page", options.page);
    await until("the gateway", () => answers(this.port));
  }

  // Makes an invite and returns the address that the visitor opens.
  invite(name) {
    const said = execFileSync(`${options.bin}/pangea-gateway`, ["invite", "--site", this.site, "--name", name], { encoding: "utf8" });
    return /https:\S+#join=\S+/.exec(said)[0];
  }

  makeKey(agent) {
    const key = `${this.site}/keys/agent_${agent}.key`;
    execFileSync(`${options.bin}/pangea-agent-handler`, ["keygen", "--agent", String(agent), "--out", key]);
    return key;
  }

  // Makes an agent without an invite, and waits until the gateway knows its key.
  async makeAgent(agent) {
    const key = this.makeKey(agent);
    await pause(kNewKey_ms);
    return { agent, key };
  }

  // Starts a native agent (pangea-uplink and pangea-vio) that plays a recording.
  startNative(agent, recording) {
    this.run("pangea-uplink", "--agent", String(agent), "--key", this.makeKey(agent), "--bus", this.agentBus, "--link", this.link);
    this.run("pangea-vio", "--agent", String(agent), "--recording", recording, "--bus", this.agentBus, "--rate", "1");
  }

  // Chromium with two changes: it trusts the key of this gateway's certificate, and it emulates no GPU, which would take more CPU time
  // than the odometry. The page draws in two dimensions.
  browser(more = []) {
    const { publicKey } = new X509Certificate(readFileSync(`${this.site}/gateway/server.pem`));
    const spki = createHash("sha256").update(publicKey.export({ type: "spki", format: "der" })).digest("base64");
    return launch([`--ignore-certificate-errors-spki-list=${spki}`, "--disable-gpu", "--disable-accelerated-2d-canvas", ...more]);
  }

  run(program, ...args) {
    const child = start(`${options.bin}/${program}`, ...args);
    child.stdout.resume();
    return child;
  }
}
