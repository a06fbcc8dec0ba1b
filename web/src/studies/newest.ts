/** One question at a time; of those asked meanwhile only the newest is asked next. */
export class Newest {
  private running: { since_ms: number; abort: AbortController } | null = null;
  private waiting: ((signal: AbortSignal) => Promise<void>) | null = null;

  /** A question that has been open for longer than `patience_ms` is given up for a newer one. */
  constructor(
    private readonly patience_ms: number,
    private readonly now_ms: () => number = () => performance.now(),
  ) {}

  ask(question: (signal: AbortSignal) => Promise<void>): void {
    this.waiting = question;
    if (!this.running) void this.next();
    else if (this.now_ms() - this.running.since_ms > this.patience_ms) this.running.abort.abort();
  }

  /** Nothing of what was asked is wanted any more. */
  forget(): void {
    this.waiting = null;
    this.running?.abort.abort();
  }

  private async next(): Promise<void> {
    while (this.waiting) {
      const question = this.waiting;
      const abort = new AbortController();
      this.waiting = null;
      this.running = { since_ms: this.now_ms(), abort };
      await question(abort.signal);
      this.running = null;
    }
  }
}
