// Which camera images the agent gets. One is with it, at most one waits; a newer one takes the place of the waiting one.
// So a phone that slows down sees fewer images, and never old ones.

interface Stamped {
  utime: number;
}

export class NewestFrame<F extends Stamped> {
  numDropped = 0;
  private waiting?: F;
  private atAgent = false;

  // `give` hands a frame to the agent, `drop` frees one.
  constructor(
    private readonly give: (frame: F) => void,
    private readonly drop: (frame: F) => void,
  ) {}

  add(frame: F) {
    if (this.waiting) {
      ++this.numDropped;
      this.drop(this.waiting);
    }
    this.waiting = frame;
    this.next();
  }

  // The agent is done with the one it had.
  done() {
    this.atAgent = false;
    this.next();
  }

  private next() {
    if (this.atAgent || !this.waiting) return;
    const frame = this.waiting;
    this.waiting = undefined;
    this.atAgent = true;
    this.give(frame);
  }
}
