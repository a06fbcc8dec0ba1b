/** The chart's colours, read from the page's theme. */
export interface Palette {
  text: string;
  muted: string;
  grid: string;
  panel: string;
  ground: string;
  groundLine: string;
  surface: string;
  path: string;
  accent: string;
  flown: string;
  replayed: string;
  good: string;
  near: string;
  bad: string;
  unknown: string;
}

const NAMES: Record<keyof Palette, string> = {
  text: "--text",
  muted: "--muted",
  grid: "--chart-grid",
  panel: "--panel",
  ground: "--chart-ground",
  groundLine: "--chart-ground-line",
  surface: "--chart-surface",
  path: "--chart-path",
  accent: "--accent",
  flown: "--flown",
  replayed: "--replayed",
  good: "--good-fill",
  near: "--near-fill",
  bad: "--bad-fill",
  unknown: "--unknown",
};

export function readPalette(): Palette {
  const style = getComputedStyle(document.documentElement);
  const entries = Object.entries(NAMES).map(([key, name]) => [key, style.getPropertyValue(name).trim()]);
  return Object.fromEntries(entries) as unknown as Palette;
}

export const CHART_FONT =
  '14px "Roboto Variable", "Segoe UI", Roboto, "Helvetica Neue", "Liberation Sans", Arial, sans-serif';
