export type Level = "good" | "near" | "bad" | "neutral";

/** Flown nearer than certified is a warning, touching is red; without a certificate there is nothing to compare. */
export function flownLevel(flown_m: number | null, certified_m: number | null): Level {
  if (flown_m === null) return "neutral";
  if (flown_m <= 0) return "bad";
  if (certified_m === null) return "neutral";
  return flown_m < certified_m ? "near" : "good";
}
