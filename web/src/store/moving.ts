import { computed, signal, type Signal } from "@preact/signals";
import type { TracksMessage, TracksStatus } from "../messages";
import { now_ms } from "./clock";
import type { Source } from "./flying";
import { SILENT_S } from "./sensing";

/** Moving objects as the server last said: live and of a recording. */
export interface Moving {
  status: TracksStatus;
  received_ms: number;
}

export const moving: Record<Source, Signal<Moving | null>> = { live: signal(null), replay: signal(null) };

/** Told once: what moves changes ten times a second. */
export const hasTracks = {
  live: computed(() => moving.live.value !== null),
  replay: computed(() => moving.replay.value !== null),
};

export function takeMoving({ source, status }: TracksMessage, received_ms: number): void {
  moving[source].value = status && { status, received_ms };
}

export function forgetMoving(source: Source): void {
  moving[source].value = null;
}

export type MovingWatch = TracksStatus["state"] | "silent";

/** What may be relied on: a node that has fallen silent is not "running", whatever it said last. */
export function movingWatch(known: Moving, isLive: boolean, at_ms: number): MovingWatch {
  const seconds = Math.max(0, at_ms - known.received_ms) / 1000;
  return isLive && seconds > SILENT_S ? "silent" : known.status.state;
}

const endangers = (source: Source) =>
  computed(() => {
    const known = moving[source].value;
    if (!known || movingWatch(known, source === "live", now_ms.value) !== "running") return false;
    return known.status.tracks.some((track) => track.dangerous);
  });

/** Something that is followed will come too near. */
export const isEndangered = { live: endangers("live"), replay: endangers("replay") };
