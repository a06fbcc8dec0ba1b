import { computed, effect, signal, untracked } from "@preact/signals";
import type { FenceHeightsDoc, FenceHeightsSet, HeightChangeDoc, OnboardDoc, WrittenDoc } from "../messages";
import { active, stillOf } from "./fleet";
import { adopted, fly } from "./flying";
import { order, pending, say } from "./outcomes";

/** Where their outcomes appear. */
export const HEIGHTS = "fence_heights";

/** What would change on the vehicle, as this page was told; null: not looked at, or written since. */
export const heights = signal<FenceHeightsDoc | null>(null);
export const heightsWritten = signal<readonly WrittenDoc[]>([]);

const aboard = computed(
  () => `${active.value} ${adopted.value?.id ?? ""} ${fly.value?.onboard.digest ?? ""}`,
);

/** Of another vehicle, or another plan on board, nothing of it holds. */
effect(() => {
  void aboard.value;
  untracked(() => {
    heights.value = null;
    heightsWritten.value = [];
  });
});

const metresOf = (value_m: number) => `${Number(value_m.toFixed(2))} m`;

/** "Floor 5 m, ceiling 60 m above home"; null: the plan on board has neither. */
export function heightsOf({ floor_rel_home_m, ceiling_rel_home_m }: OnboardDoc): string | null {
  const parts = [
    floor_rel_home_m === null ? "" : `floor ${metresOf(floor_rel_home_m)}`,
    ceiling_rel_home_m === null ? "" : `ceiling ${metresOf(ceiling_rel_home_m)}`,
  ].filter(Boolean);
  if (parts.length === 0) return null;
  const words = `${parts.join(", ")} above home`;
  return words[0]?.toUpperCase() + words.slice(1);
}

export const changeWords = ({ before, after, unit }: HeightChangeDoc) =>
  `${Number(before.toFixed(2))} → ${Number(after.toFixed(2))}${unit && ` ${unit}`}`;

export async function lookAtHeights(): Promise<void> {
  if (pending.value.has(HEIGHTS)) return;
  const [isStill, asked] = [stillOf(), aboard.peek()];
  heightsWritten.value = [];
  const answer = await order({ place: HEIGHTS, path: "/api/flight/fence_heights" });
  const doc = answer && ((await answer.json()) as FenceHeightsDoc);
  if (isStill() && aboard.peek() === asked) heights.value = doc;
}

export async function setHeights(): Promise<void> {
  const shown = heights.value;
  if (!shown || pending.value.has(HEIGHTS)) return;
  const [isStill, asked] = [stillOf(), aboard.peek()];
  const body = { changes: shown.changes };
  const answer = await order({ place: HEIGHTS, path: "/api/flight/fence_heights/set", body });
  if (!isStill() || aboard.peek() !== asked) return;
  // What was shown is asked for anew in any case: something may have been written.
  heights.value = null;
  if (!answer) return;
  const came = (await answer.json()) as FenceHeightsSet;
  if (!isStill() || aboard.peek() !== asked) return;
  heightsWritten.value = came.written;
  if (came.took) say(HEIGHTS, "On board: read back.");
}
