import type { Histogram, ReviewEvent, ReviewSeries } from "../messages";
import { valueAt } from "../chart/transform";

/** Pure steps of the Review view: what holds at a time, and where things lie on its charts. */

/** The last event at or before a time; -1 before the first. */
export function eventAt(events: readonly ReviewEvent[], at_s: number | null): number {
  if (at_s === null) return -1;
  let [low, high] = [-1, events.length - 1];
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if ((events[middle]?.t_s ?? Infinity) <= at_s + 1e-6) low = middle;
    else high = middle - 1;
  }
  return low;
}

/** When alerts began, as far as the recording tells of them. */
export const alertTimes = (events: readonly ReviewEvent[]): number[] =>
  events.filter((event) => event.kind === "alert" && event.severity <= WARNING).map((event) => event.t_s);

/** MAV_SEVERITY of what begins; an end is only information. */
const WARNING = 4;

export interface Moment {
  flown_m: number | null;
  reference_m: number | null;
  ground_m: number | null;
  cross_track_m: number | null;
  distance_m: number | null;
}

/** What the curves say at a time. */
export function momentAt(series: ReviewSeries, at_s: number): Moment {
  const at = (curve: readonly (number | null)[]) => valueAt(series.t_s, curve, at_s);
  return {
    flown_m: at(series.alt_rel_home_m),
    reference_m: at(series.reference_alt_rel_home_m),
    ground_m: at(series.ground_rel_home_m),
    cross_track_m: at(series.cross_track_m),
    distance_m: at(series.distance_to_dsm_m),
  };
}

/** Minutes and seconds for an axis. */
export function axisTime(value_s: number): string {
  const total = Math.round(Math.abs(value_s));
  return `${value_s < 0 ? "\u2212" : ""}${Math.floor(total / 60)}:${String(total % 60).padStart(2, "0")}`;
}

export interface Column {
  from: number;
  to: number;
  /** 0 to 1, of the highest one. */
  height: number;
}

/** The histogram's columns, in shares of its width and height. `reach_m` is what the width stands for. */
export function columns({ edges_m, counts }: Histogram, reach_m: number): Column[] {
  const most = Math.max(1, ...counts);
  return counts.map((amount, index) => ({
    from: (edges_m[index] ?? 0) / reach_m,
    to: (edges_m[index + 1] ?? edges_m[index] ?? 0) / reach_m,
    height: amount / most,
  }));
}

/** A little more than the largest value, so that its mark is not at the edge. */
export function reachOf({ edges_m }: Histogram, max_m: number | null): number {
  return Math.max(edges_m.at(-1) ?? 0, max_m ?? 0, 0.01) * 1.04;
}
