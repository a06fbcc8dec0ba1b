import { computed, effect, signal, untracked } from "@preact/signals";
import { adopted, linkState, vehicle } from "./flying";
import { forgetSaid } from "./outcomes";
import { failed, late_s, type Failed } from "./reach";

/**
 * What is lost while the vehicle may be in the air: nothing is louder, until somebody has seen it. Over a slow line what
 * the page shows has long changed.
 */

export type Loss = Failed | "vehicle" | "slow";

/** Unless it was disarmed when it was last heard. */
const mayFly = computed(() => adopted.value !== null && vehicle.value?.armed !== false);

export const loss = computed<Loss | null>(() => {
  if (!mayFly.value) return null;
  if (failed.value !== null) return failed.value;
  if (linkState.value === "lost") return "vehicle";
  return late_s.value === null ? null : "slow";
});

effect(() => {
  if (failed.value !== null) untracked(forgetSaid);
});

const seen = signal<Loss | null>(null);

effect(() => {
  if (loss.value === null) seen.value = null;
});

/** It is so, and nobody has said that they know; another loss than the one that was seen calls again. */
export const isLossCalling = computed(() => loss.value !== null && loss.value !== seen.value);

export function acknowledgeLoss(): void {
  seen.value = loss.value;
}
