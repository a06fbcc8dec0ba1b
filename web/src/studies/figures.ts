import { DASH, number } from "../format";
import type { ScenarioFigureDoc } from "../messages";

/** Three digits that count, as the command line has it; small numbers keep theirs. */
export function measuredText(value: number | null): string {
  if (value === null) return DASH;
  const decimals = value === 0 ? 0 : Math.min(4, Math.max(0, 2 - Math.floor(Math.log10(Math.abs(value)))));
  return number(value, Number.isInteger(value) ? 0 : decimals);
}

export const textWithUnit = (text: string, unit: string) =>
  unit && text !== DASH ? `${text} ${unit}` : text;

export function limitText({ least, most, unit }: ScenarioFigureDoc): string {
  if (least !== null && most !== null && least === most) return textWithUnit(measuredText(least), unit);
  if (least !== null) return `≥ ${textWithUnit(measuredText(least), unit)}`;
  return most === null ? "" : `≤ ${textWithUnit(measuredText(most), unit)}`;
}
