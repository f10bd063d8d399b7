// A network between pages and the gateway that can be interrupted. Meanwhile nothing passes, and no connection is closed; afterwards
// the bytes are delivered, as with TCP.

import { connect, createServer } from "node:net";

export class Network {
  isUp = true;
  sockets = new Set();
  waiting = []; // connections that were begun while it was gone

  constructor(gatewayPort) {
    this.gatewayPort = gatewayPort;
  }

  // Listens on its own port, which pages use instead of the gateway's.
  static async before(gatewayPort) {
    const network = new Network(gatewayPort);
    const server = createServer((near) => (network.isUp ? network.join(near) : network.waiting.push(near.pause())));
    await new Promise((done) => server.listen(0, "127.0.0.1", done));
    network.port = server.address().port;
    return network;
  }

  join(near) {
    const far = connect(this.gatewayPort, "127.0.0.1");
    for (const [from, to] of [[near, far], [far, near]]) {
      this.sockets.add(from);
      from.on("data", (bytes) => to.write(bytes));
      from.on("error", () => {});
      from.on("close", () => {
        this.sockets.delete(from);
        to.destroy();
      });
    }
  }

  cut() {
    this.isUp = false;
    for (const socket of this.sockets) socket.pause();
  }

  mend() {
    this.isUp = true;
    for (const socket of this.sockets) socket.resume();
    for (const near of this.waiting.splice(0)) {
      this.join(near);
      near.resume();
    }
  }
}
