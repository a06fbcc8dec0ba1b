import { number } from "../format";

/** Round marks on an axis. */

/** A round step that gives about `wanted` of them up to `reach`. */
export function roundStep(reach: number, wanted = 4): number {
  const rough = reach / wanted;
  const power = 10 ** Math.floor(Math.log10(rough));
  const factor = [1, 2, 5, 10].find((candidate) => candidate * power >= rough * 0.999) ?? 10;
  return factor * power;
}

const MOST_DECIMALS = 4;

/** As few decimals as tell an axis's steps exactly: 1 for a step of 2.5, none for 5. */
export function tickDecimals(step: number): number {
  for (let decimals = 0; decimals < MOST_DECIMALS; decimals++) {
    const scaled = step * 10 ** decimals;
    if (Math.abs(scaled - Math.round(scaled)) < 1e-6) return decimals;
  }
  return MOST_DECIMALS;
}

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
