// Maps a sensor's time stamps to the page's clock. The offset of the clocks and the delay until arrival cannot be separated. But the
// shortest delay is nearly constant, so the smallest difference of arrival and stamp is the offset plus that delay, which the odometry
// estimates as its time offset. The minimum is over a window, because the two clocks may drift.

const kWindow_us = 10_000_000;

export class ArrivalClock {
  // The smallest arrival - stamp in the current and in the former half of the window.
  private current = Infinity;
  private former = Infinity;
  private began = -Infinity;
  private newest = -Infinity;

  // The time of `stamp` on the clock of `arrival`, both in microseconds. The result increases from call to call, even if the offset
  // becomes smaller. Undefined if `stamp` is not after the last one.
  map(stamp: number, arrival: number): number | undefined {
    if (arrival - this.began > kWindow_us / 2) {
      this.former = arrival - this.began > kWindow_us ? Infinity : this.current;
      this.current = Infinity;
      this.began = arrival;
    }
    this.current = Math.min(this.current, arrival - stamp);
    const mapped = Math.round(stamp + Math.min(this.current, this.former));
    if (mapped <= this.newest) return undefined;
    this.newest = mapped;
    return mapped;
  }
}

// Converts a DOMHighResTimeStamp to microseconds since 1970.
export const utimeOf = (time_ms: number): number => Math.round(1000 * (performance.timeOrigin + time_ms));
