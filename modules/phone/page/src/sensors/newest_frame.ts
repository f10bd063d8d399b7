// Decides which camera images the agent gets. The agent has one, and at most one waits; a newer image replaces the waiting one. So a
// slow phone processes fewer images, but never old ones.

interface Stamped {
  utime: number;
}

export class NewestFrame<F extends Stamped> {
  numDropped = 0;
  private waiting?: F;
  private atAgent = false;
  private stopped = false;

  // `give` passes a frame to the agent, `drop` frees one.
  constructor(
    private readonly give: (frame: F) => void,
    private readonly drop: (frame: F) => void,
  ) {}

  add(frame: F) {
    if (this.stopped) return this.drop(frame);
    if (this.waiting) {
      ++this.numDropped;
      this.drop(this.waiting);
    }
    this.waiting = frame;
    this.next();
  }

  // The agent has processed its frame.
  done() {
    this.atAgent = false;
    this.next();
  }

  // From now on the agent gets no frame, also not the one that waits.
  stop() {
    this.stopped = true;
    if (this.waiting) this.drop(this.waiting);
    this.waiting = undefined;
  }

  private next() {
    if (this.atAgent || !this.waiting) return;
    const frame = this.waiting;
    this.waiting = undefined;
    this.atAgent = true;
    this.give(frame);
  }
}
