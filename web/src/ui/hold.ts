/** The one-second hold, without a screen: the caller passes the clock. */

export const HOLD_MS = 1000;
/** Assistive technology clicks instead of holding: two clicks within this time are the same as a hold. */
export const CONFIRM_MS = 5000;

export type Release = "early" | "nothing";

export class Hold {
  private since_ms: number | null = null;
  private asked_ms: number | null = null;

  get isHeld(): boolean {
    return this.since_ms !== null;
  }

  press(now_ms: number): void {
    this.since_ms ??= now_ms;
  }

  /** Let go, moved away, lost the focus: nothing happens. */
  release(): Release {
    const wasHeld = this.since_ms !== null;
    this.since_ms = null;
    return wasHeld ? "early" : "nothing";
  }

  /** How far the ring is filled, 0 to 1. */
  share(now_ms: number): number {
    if (this.since_ms === null) return 0;
    return Math.min(1, Math.max(0, (now_ms - this.since_ms) / HOLD_MS));
  }

  /** True once, when it has been held long enough. */
  completes(now_ms: number): boolean {
    if (this.share(now_ms) < 1) return false;
    this.since_ms = null;
    return true;
  }

  /** A click that came from no pointer and no key; true when it confirms an earlier one. */
  virtualClick(now_ms: number): boolean {
    const confirms = this.asked_ms !== null && now_ms - this.asked_ms <= CONFIRM_MS;
    this.asked_ms = confirms ? null : now_ms;
    return confirms;
  }
}
