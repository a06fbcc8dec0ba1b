import { tickDecimals } from "../chart/transform";
import { number } from "../format";
import { roundStep } from "../review/time";

export interface Tick {
  at: number;
  text: string;
}

/** Round numbers between two ends, about `wanted` of them. */
export function ticks(low: number, high: number, wanted: number): Tick[] {
  if (!(high > low)) return [];
  const step = roundStep(high - low, wanted);
  const first = Math.ceil(low / step - 1e-9);
  const count = Math.floor(high / step + 1e-9) - first + 1;
  const decimals = tickDecimals(step);
  return Array.from({ length: count }, (_, index) => {
    const at = (first + index) * step;
    return { at, text: number(at, decimals) };
  });
}
