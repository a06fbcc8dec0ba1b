import { LOST_S, type TrackDoc, type VehicleMessage } from "../messages";

/** The flown path on this page: what the server sent of it, and what has come since. Equally long lists. */
export interface Track {
  s_m: (number | null)[];
  alt_rel_home_m: (number | null)[];
  cross_track_m: (number | null)[];
  t_s: number[];
  /** The clock of the first place that was added here, and its `t_s`. */
  anchor: { mono_s: number; t_s: number } | null;
  /** The clock of the newest position, added or not. */
  placed_s: number | null;
}

const LEAST_STEP_S = 0.2;
/** Beyond it every other place is dropped: the line is drawn on a few hundred pixels. */
const MOST_PLACES = 12_000;

export const emptyTrack = (): Track => ({
  s_m: [],
  alt_rel_home_m: [],
  cross_track_m: [],
  t_s: [],
  anchor: null,
  placed_s: null,
});

export const trackFrom = (doc: TrackDoc): Track => ({
  s_m: [...doc.s_m],
  alt_rel_home_m: [...doc.alt_rel_home_m],
  cross_track_m: [...doc.cross_track_m],
  t_s: [...doc.t_s],
  anchor: null,
  placed_s: null,
});

/** Goes on with where the vehicle is now, in place; returns whether anything was added. */
export function extend(track: Track, message: VehicleMessage): boolean {
  const { state, follow, now_mono_s } = message;
  if (!state?.armed || follow?.s_m == null) return false;
  const last_s = track.t_s.at(-1);
  track.anchor ??= { mono_s: now_mono_s, t_s: last_s ?? 0 };
  const t_s = track.anchor.t_s + now_mono_s - track.anchor.mono_s;
  const wasLost = hasBeenLost(track, state.position_t_mono_s);
  if (!wasLost && last_s !== undefined && t_s - last_s < LEAST_STEP_S) return false;
  if (wasLost) push(track, t_s, null, null, null);
  push(track, t_s, follow.s_m, follow.alt_rel_home_m, follow.cross_track_m);
  if (track.t_s.length > MOST_PLACES) thin(track);
  return true;
}

/** Nobody knew for a while where it was: no line leads there. */
function hasBeenLost(track: Track, placed_s: number | null): boolean {
  const before_s = track.placed_s;
  if (placed_s === null) return false;
  track.placed_s = placed_s;
  return before_s !== null && track.t_s.length > 0 && placed_s - before_s > LOST_S;
}

type Value = number | null;

function push(track: Track, t_s: number, s_m: Value, alt_rel_home_m: Value, cross_track_m: Value): void {
  track.s_m.push(s_m);
  track.alt_rel_home_m.push(alt_rel_home_m);
  track.cross_track_m.push(cross_track_m);
  track.t_s.push(t_s);
}

function thin(track: Track): void {
  // A row that parts the line stays.
  const gaps = new Set(track.s_m.flatMap((s_m, index) => (s_m === null ? [index] : [])));
  const everyOther = (_: unknown, index: number) => index % 2 === 0 || gaps.has(index);
  track.s_m = track.s_m.filter(everyOther);
  track.alt_rel_home_m = track.alt_rel_home_m.filter(everyOther);
  track.cross_track_m = track.cross_track_m.filter(everyOther);
  track.t_s = track.t_s.filter(everyOther);
}
