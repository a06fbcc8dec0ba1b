import { metres } from "../format";
import type { ReviewFigures } from "../messages";

export type Level = "good" | "near" | "bad" | "neutral";

/** Below the requirement and touching are red, nearer than certified a warning; without either nothing is compared. */
export function flownLevel(
  flown_m: number | null,
  certified_m: number | null,
  required_m: number | null = null,
): Level {
  if (flown_m === null) return "neutral";
  if (flown_m <= 0 || (required_m !== null && flown_m < required_m)) return "bad";
  if (certified_m === null) return "neutral";
  return flown_m < certified_m ? "near" : "good";
}

/** Where avoidance went on above the plan; null where the flight kept to it. */
export function higherWords(figures: ReviewFigures): string | null {
  const { higher_m, higher_from_item } = figures;
  if (higher_m === null || higher_from_item === null) return null;
  return `by ${metres(higher_m, 0)} from item ${higher_from_item}`;
}
