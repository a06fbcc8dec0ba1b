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
