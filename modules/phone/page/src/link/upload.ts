// Uploads a recording to the gateway: first the proof as on the link, then the size and the bytes. It sends at most as far ahead of
// the bytes taken by the server as allowed (modules/gateway/recording/recording_socket.h).

import type { Membership } from "../messages";
import { proofOf } from "./gateway_link";

const kMessage_bytes = 60_000;
const kWindow_bytes = 1_000_000;
const kSilent_ms = 60_000; // the server answers everything; at the end it first writes the recording to its disk
const kKept = 4200; // close code; the reason is the file's name
const kLost = "the connection was lost";

class Upload {
  private proven = false;
  private sent = 0;
  private taken = 0;
  private sending = false;

  constructor(
    private readonly socket: WebSocket,
    private readonly membership: Membership,
    private readonly zip: Blob,
    private readonly onProgress: (share: number) => void,
  ) {}

  async take(message: ArrayBuffer) {
    if (!this.proven) return this.prove(new Uint8Array(message));
    this.taken = Number(new DataView(message).getBigUint64(0, true));
    this.onProgress(this.taken / this.zip.size);
    await this.sendMore();
  }

  private async prove(nonce: Uint8Array) {
    this.proven = true;
    const proof = await proofOf(this.membership.key, this.membership.agent, nonce);
    const size = new DataView(new ArrayBuffer(8));
    size.setBigUint64(0, BigInt(this.zip.size), true);
    this.socket.send(proof);
    this.socket.send(size.buffer);
  }

  private async sendMore() {
    if (this.sending) return;
    this.sending = true;
    while (this.socket.readyState === WebSocket.OPEN) {
      const end = Math.min(this.sent + kMessage_bytes, this.taken + kWindow_bytes, this.zip.size);
      if (end === this.sent) break;
      this.socket.send(await this.zip.slice(this.sent, end).arrayBuffer());
      this.sent = end;
    }
    this.sending = false;
  }
}

// Resolves to the file's name at the server. Fails with a text for the visitor if the server does not keep the recording.
export function uploadRecording(origin: string, membership: Membership, zip: Blob, onProgress: (share: number) => void): Promise<string> {
  return new Promise((done, failed) => {
    const socket = new WebSocket(`${origin}/recording?agent=${membership.agent}`);
    socket.binaryType = "arraybuffer";
    const upload = new Upload(socket, membership, zip, onProgress);
    const fail = (error: Error) => {
      clearTimeout(silence);
      socket.close();
      failed(error);
    };
    let silence: ReturnType<typeof setTimeout>;
    const listen = () => {
      clearTimeout(silence);
      silence = setTimeout(() => fail(new Error(kLost)), kSilent_ms);
    };
    listen();
    socket.onmessage = ({ data }: MessageEvent<ArrayBuffer>) => {
      listen();
      upload.take(data).catch(fail);
    };
    socket.onclose = ({ code, reason }) => {
      clearTimeout(silence);
      if (code === kKept) done(reason);
      else failed(new Error(reason || kLost));
    };
  });
}
