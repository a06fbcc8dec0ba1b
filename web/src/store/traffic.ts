import { computed, signal, type Signal } from "@preact/signals";
import type { TrafficMessage, TrafficSettings, TrafficStatus } from "../messages";
import { now_ms } from "./clock";
import type { Source } from "./flying";
import { SILENT_S } from "./sensing";

/** Other aircraft as the server last said: live and of a recording. */
export interface Traffic {
  settings: TrafficSettings;
  /** Null: nothing was heard of any yet. */
  status: TrafficStatus | null;
  received_ms: number;
}

export const traffic: Record<Source, Signal<Traffic | null>> = { live: signal(null), replay: signal(null) };

/** Told once: ages change all the time. */
export const hasTraffic = {
  live: computed(() => Boolean(traffic.live.value?.status)),
  replay: computed(() => Boolean(traffic.replay.value?.status)),
};

export function takeTraffic({ source, settings, status }: TrafficMessage, received_ms: number): void {
  traffic[source].value = { settings, status, received_ms };
}

export function forgetTraffic(source: Source): void {
  traffic[source].value = null;
}

/** How old the page's own news is; in a recording time stands still. */
export function sinceTold_s({ received_ms }: Traffic, source: Source): number {
  return source === "live" ? Math.max(0, now_ms.value - received_ms) / 1000 : 0;
}

export const isSilent = (known: Traffic, source: Source) => sinceTold_s(known, source) > SILENT_S;
