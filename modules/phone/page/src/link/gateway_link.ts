// The agent's WebSocket to the gateway: sealed packets in both directions, one per message. The gateway first sends a nonce, and gets
// a proof that we have the agent's key. A lost WebSocket is opened again.

import type { LinkState } from "../messages";

const kFirstRetry_ms = 1000;
const kLongestRetry_ms = 15_000;
const kSilent_ms = 10_000; // the server answers every second: after this the network is gone, and a new socket sooner through than an old one
const kMaxWaiting_bytes = 256_000; // in the socket; beyond it packets are dropped, and the link repeats them

// The close codes after which we do not connect again: the key is unknown or revoked; another page of this agent connected.
const kFinal = new Map<number, LinkState>([[4401, "refused"], [4409, "replaced"]]);

// The WebSocket origin of the gateway that served this page.
export const gatewayOrigin = () => `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}`;

function bytesOfHex(hex: string): Uint8Array<ArrayBuffer> {
  return Uint8Array.from(hex.match(/../g) ?? [], (byte) => parseInt(byte, 16));
}

// The proof: HMAC-SHA-256(key, "pangea-gateway-v1:" + agent + ":" + nonce).
export async function proofOf(keyHex: string, agent: number, nonce: Uint8Array): Promise<Uint8Array<ArrayBuffer>> {
  const hmac = { name: "HMAC", hash: "SHA-256" };
  const key = await crypto.subtle.importKey("raw", bytesOfHex(keyHex), hmac, false, ["sign"]);
  const prefix = new TextEncoder().encode(`pangea-gateway-v1:${agent}:`);
  const message = new Uint8Array([...prefix, ...nonce]);
  return new Uint8Array(await crypto.subtle.sign("HMAC", key, message));
}

export class GatewayLink {
  state: LinkState = "connecting";
  private socket?: WebSocket;
  private retry_ms = kFirstRetry_ms;
  private proven = false;
  private openedAt = -Infinity; // ms
  private silence?: ReturnType<typeof setTimeout>;
  private retry?: ReturnType<typeof setTimeout>;

  constructor(
    private readonly origin: string, // "wss://host:port"
    private readonly agent: number,
    private readonly keyHex: string,
    private readonly onPacket: (packet: Uint8Array) => void,
  ) {
    this.connect();
  }

  // False if the packet was not sent; the link sends it again later.
  send(packet: Uint8Array): boolean {
    if (this.state !== "open" || this.socket?.readyState !== WebSocket.OPEN || this.socket.bufferedAmount > kMaxWaiting_bytes) return false;
    this.socket.send(packet as Uint8Array<ArrayBuffer>);
    return true;
  }

  // Ends the link for good.
  close() {
    clearTimeout(this.silence);
    clearTimeout(this.retry);
    this.giveUp();
  }

  private connect() {
    this.proven = false;
    const socket = new WebSocket(`${this.origin}/link?agent=${this.agent}`);
    this.socket = socket;
    socket.binaryType = "arraybuffer";
    socket.onmessage = ({ data }: MessageEvent<ArrayBuffer>) => this.take(socket, new Uint8Array(data));
    socket.onclose = ({ code }) => this.lost(code);
    this.listen();
  }

  // Restarts the timer for silence. After it the socket is given up without waiting for it to close, which takes longer still in a
  // network that is gone.
  private listen() {
    clearTimeout(this.silence);
    this.silence = setTimeout(() => {
      this.giveUp();
      this.lost();
    }, kSilent_ms);
  }

  private giveUp() {
    if (!this.socket) return;
    this.socket.onmessage = this.socket.onclose = null;
    this.socket.close();
  }

  private take(socket: WebSocket, message: Uint8Array) {
    this.listen();
    if (this.proven) return this.onPacket(message);
    this.proven = true;
    void proofOf(this.keyHex, this.agent, message).then((proof) => {
      if (socket.readyState !== WebSocket.OPEN) return;
      socket.send(proof);
      this.state = "open";
      this.openedAt = performance.now();
    });
  }

  private lost(code = 0) {
    clearTimeout(this.silence);
    const openFor_ms = performance.now() - this.openedAt;
    if (this.state === "open" && openFor_ms > kLongestRetry_ms) this.retry_ms = kFirstRetry_ms;
    this.state = kFinal.get(code) ?? "connecting";
    if (kFinal.has(code)) return;
    this.retry = setTimeout(() => this.connect(), this.retry_ms);
    this.retry_ms = Math.min(2 * this.retry_ms, kLongestRetry_ms);
  }
}
