import { computed, effect, signal } from "@preact/signals";
import type { ErrorDoc, VehicleState } from "../messages";
import { fly, vehicle } from "./flying";

const WHERE = { floor: "floor", ceiling: "ceiling", boundary: "boundary" } as const;

/** What of its fence a vehicle says that it is beyond; null: nothing, or it does not say. */
export function crossed(state: Pick<VehicleState, "fence_ok" | "fence_breach"> | null): string | null {
  const told = state?.fence_breach;
  if (told && told !== "none") return WHERE[told];
  return state?.fence_ok === false ? "fence" : null;
}

const place = computed(() => crossed(vehicle.value));

/** The vehicle is beyond its fence, in words with what it does about it. */
export const breach = computed<ErrorDoc | null>(() => {
  if (place.value === null) return null;
  const what = place.value === "fence" ? "its fence" : `the ${place.value} of its fence`;
  const does = fly.value?.at_fence || "What it does there was not read.";
  const advice =
    "Watch its mode: it may have left the mission. Hold it or command the return if it does not.";
  return { code: "fence", what: `The vehicle says that it is beyond ${what}.`, where: does, advice };
});

const seen = signal<string | null>(null);

effect(() => {
  if (place.value === null) seen.value = null;
});

/** It is so, and nobody here has said that they know; another part of the fence calls again. */
export const isBreachCalling = computed(() => place.value !== null && place.value !== seen.value);

export function acknowledgeBreach(): void {
  seen.value = place.value;
}
