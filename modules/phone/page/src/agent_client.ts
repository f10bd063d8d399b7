// The page's side of the worker that runs the agent: sensor data go in, the agent's messages come out.

import type { Pose7 } from "./agent/phone_agent";
import type { CameraImage } from "./sensors/camera";
import { packImu } from "./messages";
import type { FromWorker, OpenAgent, ToWorker } from "./messages";
import type { ImuSample } from "./recording/euroc";

const kLongestClose_ms = 3000; // longest wait for an agent that no longer answers

type Image = Pick<CameraImage, "utime" | "luma" | "width" | "height" | "stride"> & { T_odom_body?: Pose7 | null };

export class AgentClient {
  private readonly worker = new Worker(new URL("./worker.ts", import.meta.url), { type: "module" });

  private closed = () => {};
  private closing?: Promise<void>;

  // `onMessage` gets at most one failure, and none after close().
  constructor(open: OpenAgent, private readonly onMessage: (message: FromWorker) => void) {
    this.worker.onmessage = ({ data }: MessageEvent<FromWorker>) => this.take(data);
    this.worker.onerror = ({ message }) => this.take({ kind: "failed", text: message || "The agent's script cannot be loaded." });
    this.say(open);
  }

  addImu(samples: ImuSample[]) {
    const values = packImu(samples);
    this.say({ kind: "imu", samples: values }, [values.buffer]);
  }

  // Transfers the image's luma to the worker; it cannot be used here afterwards.
  addImage({ utime, luma, width, height, stride, T_odom_body }: Image) {
    this.say({ kind: "image", utime, luma, width, height, stride, T_odom_body }, [luma.buffer]);
  }

  say(message: ToWorker, transfer: Transferable[] = []) {
    this.worker.postMessage(message, transfer);
  }

  // Resolves when all that is unsent is stored.
  close(): Promise<void> {
    return (this.closing ??= this.end());
  }

  private async end() {
    const closed = new Promise<void>((done) => (this.closed = done));
    this.say({ kind: "close" });
    await Promise.race([closed, new Promise((done) => setTimeout(done, kLongestClose_ms))]);
    this.worker.terminate();
  }

  // An agent that has failed is closed at once, because it would fail again and again.
  private take(message: FromWorker) {
    if (message.kind === "closed") return this.closed();
    if (message.kind === "failed") {
      if (this.closing) return;
      void this.close();
    }
    this.onMessage(message);
  }
}
