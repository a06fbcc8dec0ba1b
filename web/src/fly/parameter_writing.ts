import { computed } from "@preact/signals";
import { vehicle } from "../store/flying";
import { pending } from "../store/outcomes";
import { PARAMETERS } from "../store/parameters";
import { whyNotCommand } from "../store/reach";

/** Why nothing can be written now; null: it can. */
export const whyNotWrite = computed<string | null>(() => {
  if (whyNotCommand.value) return whyNotCommand.value;
  return vehicle.value?.armed
    ? "The vehicle is armed: parameters change how it flies at once. Land and disarm it."
    : null;
});

export const outcomesPending = computed(() => pending.value.has(PARAMETERS));
