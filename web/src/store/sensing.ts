import type { PerceptionMessage, PerceptionStatus } from "../messages";

/** What the page knows of one sensor: its last word, when it came, and how many frames a second. */
export interface Sensed {
  status: PerceptionStatus;
  now_mono_s: number;
  received_ms: number;
  rate_hz: number | null;
  /** When it said last that it watches, by this page's clock; null: not since this page looks. */
  watched_ms: number | null;
  marks: readonly Mark[];
}

interface Mark {
  t_mono_s: number;
  frames: number;
}

/** Rates are counted over so long: short enough to see a sensor slow down, long enough to stand still. */
const WINDOW_S = 3;
const LEAST_S = 0.45;

/** A recording that was wound back, or a node that began anew, starts the count again. */
function marksWith(before: readonly Mark[], now: Mark): readonly Mark[] {
  const last = before.at(-1);
  if (last && (now.t_mono_s < last.t_mono_s || now.frames < last.frames)) return [now];
  if (last && now.t_mono_s - last.t_mono_s > WINDOW_S) return [last, now];
  return [...before.filter((mark) => now.t_mono_s - mark.t_mono_s <= WINDOW_S), now];
}

function rateOf(marks: readonly Mark[]): number | null {
  const [first, last] = [marks[0], marks.at(-1)];
  if (!first || !last || last.t_mono_s - first.t_mono_s < LEAST_S) return null;
  return (last.frames - first.frames) / (last.t_mono_s - first.t_mono_s);
}

export function withStatus(
  before: Sensed | undefined,
  message: PerceptionMessage & { status: PerceptionStatus },
  received_ms: number,
): Sensed {
  const { status, now_mono_s } = message;
  const marks = marksWith(before?.marks ?? [], { t_mono_s: status.t_mono_s, frames: status.frames });
  const watched_ms = status.state === "running" ? received_ms : (before?.watched_ms ?? null);
  return { status, now_mono_s, received_ms, rate_hz: rateOf(marks), watched_ms, marks };
}

/** A node says something every second; after this it is silent. */
export const SILENT_S = 2.5;

/** Seconds since a live sensor's node said anything; a recording is never silent. */
export function silence_s(sensed: Sensed, isLive: boolean, now_ms: number): number | null {
  const seconds = Math.max(0, now_ms - sensed.received_ms) / 1000;
  return isLive && seconds > SILENT_S ? seconds : null;
}

export type Watch = PerceptionStatus["state"] | "silent";

/** What may be relied on: a node that has fallen silent is not "running", whatever it said last. */
export const watchOf = (sensed: Sensed, isLive: boolean, now_ms: number): Watch =>
  silence_s(sensed, isLive, now_ms) === null ? sensed.status.state : "silent";

/** Seconds since a sensor that does not watch now did so last: so old is what is shown of it. Null: it watches, or
 * nobody here knows. */
export function sightAge_s(sensed: Sensed, isLive: boolean, now_ms: number): number | null {
  if (watchOf(sensed, isLive, now_ms) === "running" || sensed.watched_ms === null) return null;
  return Math.max(0, now_ms - sensed.watched_ms) / 1000;
}
