// Gives the device's motion as inertial samples in the body frame, at the 60 Hz of browsers. The first samples are left out, until it is
// known which sign the platform gives to gravity.

import type { ImuSample } from "../recording/euroc";
import { GravitySign, toBody, upInBody } from "./axes";
import type { Vector3 } from "./axes";
import { utimeOf } from "./clock";

const kSilence_ms = 3000;
const kLongestDecision_us = 1_000_000; // longest wait for the sign of gravity, because some phones give no orientation

// Some browsers ask the user for permission; iOS only allows asking within a tap. The answer is not used: motion comes or not.
type Asking = { requestPermission?: () => Promise<PermissionState> };

export async function askForMotion(): Promise<void> {
  for (const event of [window.DeviceMotionEvent, window.DeviceOrientationEvent] as (Asking | undefined)[]) {
    if (!event) throw new Error("This browser tells no motion: open the page on a phone.");
    await event.requestPermission?.();
  }
}

export class Motion {
  private readonly sign = new GravitySign();
  private up?: Vector3;
  private first?: number; // us
  private newest = 0;
  private readonly silence: ReturnType<typeof setTimeout>;

  constructor(
    private readonly onSample: (sample: ImuSample) => void,
    onSilence: () => void, // called if no motion comes
  ) {
    addEventListener("devicemotion", this.onMotion);
    addEventListener("deviceorientation", this.onOrientation);
    this.silence = setTimeout(() => this.newest === 0 && onSilence(), kSilence_ms);
  }

  stop() {
    removeEventListener("devicemotion", this.onMotion);
    removeEventListener("deviceorientation", this.onOrientation);
    clearTimeout(this.silence);
  }

  private readonly onOrientation = ({ beta, gamma }: DeviceOrientationEvent) => {
    if (beta !== null && gamma !== null) this.up = upInBody(beta, gamma);
  };

  private readonly onMotion = ({ accelerationIncludingGravity: a, rotationRate: r, timeStamp }: DeviceMotionEvent) => {
    const acceleration = [a?.x, a?.y, a?.z];
    const rate = [r?.alpha, r?.beta, r?.gamma];
    const known = (values: unknown[]): values is Vector3 => values.every((value) => typeof value === "number");
    const utime = utimeOf(timeStamp);
    if (!known(acceleration) || !known(rate) || utime <= this.newest) return;
    this.newest = utime;
    if (this.up) this.sign.add(acceleration, this.up);
    if (!this.sign.decided && utime - (this.first ??= utime) < kLongestDecision_us) return;
    this.onSample({ utime, ...toBody({ acceleration, rate }, this.sign.sign) });
  };
}
