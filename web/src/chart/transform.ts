import type { Chart } from "../messages";

/** Pure steps from the server's curves to what is drawn. */

export type Curve = readonly (number | null)[];
/** From and to along the path, in metres. */
export type Span = readonly [number, number];

export type Level = "good" | "near" | "bad" | "unknown";

export interface LevelSpan {
  from_m: number;
  to_m: number;
  level: Level;
}

/** Red inside or touching, orange below the requirement, green otherwise; never green where it is unknown. */
export function levelOf(distance_m: number | null, required_m: number): Level {
  if (distance_m === null || !Number.isFinite(distance_m)) return "unknown";
  if (distance_m <= 0) return "bad";
  return distance_m < required_m ? "near" : "good";
}

const SEVERITY: Record<Level, number> = { good: 0, near: 1, bad: 2, unknown: 3 };

/** The strip of clearance colours: neighbouring steps of one level joined, each step as bad as its worse end. */
export function levelSpans(s_m: readonly number[], distance_m: Curve, required_m: number): LevelSpan[] {
  const spans: LevelSpan[] = [];
  for (let index = 1; index < s_m.length; index++) {
    const ends = [distance_m[index - 1] ?? null, distance_m[index] ?? null].map((d) =>
      levelOf(d, required_m),
    );
    const level = ends.reduce((a, b) => (SEVERITY[b] > SEVERITY[a] ? b : a));
    const [from_m = 0, to_m = 0] = [s_m[index - 1], s_m[index]];
    const last = spans.at(-1);
    if (last?.level === level) last.to_m = to_m;
    else spans.push({ from_m, to_m, level });
  }
  return spans;
}

/** Where a curve has no value: drawn as unknown, not as flat ground. */
export function gaps(s_m: readonly number[], curve: Curve): Span[] {
  const found: [number, number][] = [];
  let start: number | null = null;
  for (let index = 0; index < s_m.length; index++) {
    const at = s_m[index] ?? 0;
    const isMissing = curve[index] == null;
    if (isMissing && start === null) start = s_m[Math.max(0, index - 1)] ?? at;
    if (!isMissing && start !== null) {
      found.push([start, at]);
      start = null;
    }
  }
  if (start !== null) found.push([start, s_m.at(-1) ?? start]);
  return found;
}

/** Lowest and highest value of some curves with a margin; a flat world still gets some height. */
export function heightRange(curves: readonly Curve[], margin = 0.08): Span {
  let [low, high] = [Infinity, -Infinity];
  for (const curve of curves) {
    for (const value of curve) {
      if (value === null || !Number.isFinite(value)) continue;
      low = Math.min(low, value);
      high = Math.max(high, value);
    }
  }
  if (low > high) return [0, 10];
  const pad = Math.max((high - low) * margin, 1);
  return [low - pad, high + pad];
}

/** A curve's value at a place: linear between neighbours, null beside a gap or outside. */
export function valueAt(s_m: readonly number[], curve: Curve, at_m: number): number | null {
  const last = s_m.length - 1;
  const [first_m, last_m] = [s_m[0], s_m[last]];
  if (first_m === undefined || last_m === undefined || at_m < first_m || at_m > last_m) return null;
  let [low, high] = [0, last];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if ((s_m[middle] ?? 0) <= at_m) low = middle;
    else high = middle;
  }
  const [s0 = 0, s1 = 0] = [s_m[low], s_m[high]];
  const [v0, v1] = [curve[low] ?? null, curve[high] ?? null];
  if (v0 === null || v1 === null) return null;
  return s1 === s0 ? v0 : v0 + ((v1 - v0) * (at_m - s0)) / (s1 - s0);
}

/** Labels that do not fit beside each other are left out, from left to right. */
export function labelsThatFit(x_px: readonly number[], width_px: readonly number[], gap_px = 6): boolean[] {
  let right = -Infinity;
  return x_px.map((x, index) => {
    const half = (width_px[index] ?? 0) / 2;
    if (x - half < right + gap_px) return false;
    right = x + half;
    return true;
  });
}

/** All that the altitude chart's vertical axis must show; `flown` is what was flown along the path. */
export const profileRange = (chart: Chart, flown: Span | null = null): Span =>
  heightRange([
    chart.ground_rel_home_m,
    chart.surface_rel_home_m,
    chart.path_rel_home_m,
    chart.flown_rel_home_m,
    flown ?? [],
  ]);

/** In so coarse steps that the axis changes seldom while a vehicle climbs. */
const FLOWN_STEP_M = 5;

/** The heights flown along the path, whatever is planned there, outwards to the next step; null before any. */
export function flownSpan(s_m: Curve, alt_m: Curve): Span | null {
  let [low, high] = [Infinity, -Infinity];
  for (let index = 0; index < alt_m.length; index++) {
    const value = alt_m[index];
    if (value == null || s_m[index] == null || !Number.isFinite(value)) continue;
    low = Math.min(low, value);
    high = Math.max(high, value);
  }
  if (low > high) return null;
  return [Math.floor(low / FLOWN_STEP_M) * FLOWN_STEP_M, Math.ceil(high / FLOWN_STEP_M) * FLOWN_STEP_M];
}
