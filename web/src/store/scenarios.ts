import { computed, signal } from "@preact/signals";
import type { ScenarioDoc, ScenarioResultDoc, ScenarioRunDoc } from "../messages";

/** What there is; null: not asked yet. */
export const scenarios = signal<readonly ScenarioDoc[] | null>(null);
/** The one that runs, and those that were run, newest first. */
export const runs = signal<readonly ScenarioRunDoc[]>([]);
/** The scenario that this page looks at, and the result that is open. */
export const chosenName = signal<string | null>(null);
export const shownResult = signal<ScenarioResultDoc | null>(null);

export const running = computed(() => runs.value.find((run) => run.state === "running") ?? null);
export const chosenScenario = computed(
  () => scenarios.value?.find((one) => one.name === chosenName.value) ?? null,
);
