// The clock of a sensor's stamps, laid onto the page's clock. A stamp's own epoch and the delay until its arrival are not
// known apart; but the shortest delay is nearly constant, so the smallest difference of arrival and stamp is the offset,
// up to that delay, which the odometry finds as its time offset. Seen over a window, so that two clocks may drift apart.

const kWindow_us = 10_000_000;

export class ArrivalClock {
  // Of the current and of the former half of the window: the smallest arrival - stamp.
  private current = Infinity;
  private former = Infinity;
  private began = -Infinity;
  private newest = -Infinity;

  // The time of `stamp` on the clock of `arrival`, both in microseconds. Grows from call to call, also where the offset has
  // shrunk; a stamp that does not go on from the last gives nothing.
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

// Microseconds since 1970 of a DOMHighResTimeStamp.
export const utimeOf = (time_ms: number): number => Math.round(1000 * (performance.timeOrigin + time_ms));
