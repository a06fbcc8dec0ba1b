import type { ClockMessage } from "../messages";

/** What one answer to a ping says: the server's clock less this page's, and how wrong that may be. */
interface Sample {
  offset_s: number;
  error_s: number;
  at_ms: number;
}

const KEPT_MS = 60_000;

let best: Sample | null = null;

/** Of the answers of the last minute the quickest counts: half its way there and back is all that is unknown. */
export function takeClock(message: ClockMessage, now_ms: number): void {
  const error_s = Math.max(0, now_ms - message.page_ms) / 2000;
  const offset_s = message.now_mono_s - (message.page_ms + now_ms) / 2000;
  const isOld = best !== null && now_ms - best.at_ms > KEPT_MS;
  // A page that slept, or another server: the two cannot both be right, and this one is newer.
  const disagrees = best !== null && Math.abs(offset_s - best.offset_s) > error_s + best.error_s;
  if (best === null || isOld || disagrees || error_s <= best.error_s)
    best = { offset_s, error_s, at_ms: now_ms };
}

/** Another connection: whatever lay between, a computer that slept or another server, the old clock says nothing. */
export function forgetClock(): void {
  best = null;
}

/** The server's clock now, seconds, at the latest: nothing is taken for newer than it is. Null before the first answer. */
export const serverNow_s = (now_ms: number): number | null =>
  best === null ? null : now_ms / 1000 + best.offset_s + best.error_s;
