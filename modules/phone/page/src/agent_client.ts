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

  constructor(open: OpenAgent, onMessage: (message: FromWorker) => void) {
    this.worker.onmessage = ({ data }: MessageEvent<FromWorker>) => (data.kind === "closed" ? this.closed() : onMessage(data));
    this.worker.onerror = ({ message }) => onMessage({ kind: "failed", text: message || "The agent's script cannot be loaded." });
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

  // Resolves when all unsent keyframes are stored.
  async close(): Promise<void> {
    const closed = new Promise<void>((done) => (this.closed = done));
    this.say({ kind: "close" });
    await Promise.race([closed, new Promise((done) => setTimeout(done, kLongestClose_ms))]);
    this.worker.terminate();
  }
}
