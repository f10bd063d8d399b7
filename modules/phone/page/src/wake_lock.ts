// Keeps the screen on during a walk, where the browser can.

export class WakeLock {
  private lock?: Promise<WakeLockSentinel | undefined>;

  // Call it again when the page is visible again, because a hidden page loses the lock.
  keep() {
    this.release();
    this.lock = navigator.wakeLock?.request("screen").catch(() => undefined);
  }

  release() {
    void this.lock?.then((lock) => lock?.release());
    this.lock = undefined;
  }
}
