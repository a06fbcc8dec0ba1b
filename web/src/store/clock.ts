import { signal } from "@preact/signals";

const TICK_MS = 250;

/** This page's monotonic clock, for ages that grow while nothing arrives. */
export const now_ms = signal(performance.now());

export function startClock(): void {
  setInterval(() => (now_ms.value = performance.now()), TICK_MS);
}
