// The page's side of the worker that runs the agent: sensor data go in, the agent's messages come out.

import type { Pose7 } from "./agent/phone_agent";
import type { CameraImage } from "./sensors/camera";
import { packImu } from "./messages";
import type { FromWorker, OpenAgent, ToWorker } from "./messages";
import type { ImuSample } from "./recording/euroc";

const kLongestClose_ms = 3000; // longest wait for an agent that no longer answers

type Image = Pick<CameraImage, "utime" | "luma" | "width" | "height" | "stride"> & { T_odom_body?: Pose7 | null };

// A worker whose agent is closed. The next agent gets it, because a page without network cannot load the agent's program again.
let idle: Worker | undefined;

export class AgentClient {
  private readonly worker: Worker;
  private hasFailed = false;
  private closing?: Promise<void>;
  private closed = () => {};

  // `onMessage` gets at most one failure, and none after close().
  constructor(open: OpenAgent, private readonly onMessage: (message: FromWorker) => void) {
    this.worker = idle ?? new Worker(new URL("./worker.ts", import.meta.url), { type: "module" });
    idle = undefined;
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

  // Does nothing after close(): the worker may have another agent then.
  say(message: ToWorker, transfer: Transferable[] = []) {
    if (!this.closing) this.worker.postMessage(message, transfer);
  }

  // Resolves when all that is unsent is stored.
  close(): Promise<void> {
    return (this.closing ??= this.end());
  }

  private async end() {
    const isClosed = new Promise<boolean>((done) => (this.closed = () => done(true)));
    const isLate = new Promise<boolean>((done) => setTimeout(() => done(false), kLongestClose_ms));
    this.say({ kind: "close" });
    const mayServe = (await Promise.race([isClosed, isLate])) && !this.hasFailed && !idle;
    if (mayServe) idle = this.worker;
    else this.worker.terminate();
  }

  // An agent that has failed is closed at once, because it would fail again and again.
  private take(message: FromWorker) {
    if (message.kind === "failed") {
      this.hasFailed = true;
      if (this.closing) return this.closed();
      void this.close();
    }
    if (message.kind === "closed") return this.closed();
    this.onMessage(message);
  }
}
