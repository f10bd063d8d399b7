// The WebSocket to the server; it is opened again when it is lost.

import { decode } from "./protocol";
import type { Said, Update } from "./protocol";

const kRetry_ms = 1000;

export class Connection {
  bytes = 0; // received since the page was opened
  private socket?: WebSocket;

  constructor(
    private readonly onUpdate: (update: Update) => void,
    private readonly onState: (open: boolean) => void,
  ) {
    this.connect();
  }

  // False if there is no connection, or it is about to end.
  say(said: Said): boolean {
    if (this.socket?.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify(said));
    return true;
  }

  private connect() {
    const socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/`);
    this.socket = socket;
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.onState(true);
    };
    socket.onmessage = ({ data }: MessageEvent<ArrayBuffer>) => {
      try {
        this.take(data);
      } catch (error) {
        // The server waits until the update is taken, so the page would stay as it is. A new socket gets everything again.
        console.error(error);
        socket.close();
      }
    };
    socket.onclose = () => {
      this.onState(false);
      setTimeout(() => this.connect(), kRetry_ms);
    };
  }

  private take(data: ArrayBuffer) {
    this.bytes += data.byteLength;
    const update = decode(data);
    this.onUpdate(update);
    this.say({ taken: update.version });
  }
}
