import { metres } from "../format";
import type { ReviewFigures } from "../messages";

/** Where avoidance went on above the plan; null where the flight kept to it. */
export function higherWords(figures: ReviewFigures): string | null {
  const { higher_m, higher_from_item } = figures;
  if (higher_m === null || higher_from_item === null) return null;
  return `by ${metres(higher_m, 0)} from item ${higher_from_item}`;
}
