import type { RadarMap } from "../messages";

/** Viridis, in ten steps between which colours are mixed: even to the eye, and readable without colour vision. */
const STEPS = [
  [68, 1, 84],
  [72, 40, 120],
  [62, 73, 137],
  [49, 104, 142],
  [38, 130, 142],
  [31, 158, 137],
  [53, 183, 121],
  [110, 206, 88],
  [181, 222, 43],
  [253, 231, 37],
] as const;

function mixed(share: number): [number, number, number] {
  const at = Math.min(STEPS.length - 1, Math.max(0, share * (STEPS.length - 1)));
  const low = Math.min(STEPS.length - 2, Math.floor(at));
  const [from, to] = [STEPS[low] ?? STEPS[0], STEPS[low + 1] ?? STEPS[0]];
  const part = (channel: 0 | 1 | 2) => Math.round(from[channel] + (to[channel] - from[channel]) * (at - low));
  return [part(0), part(1), part(2)];
}

/** Red, green and blue of each of the 256 levels. */
export const LEVELS: readonly (readonly [number, number, number])[] = Array.from(
  { length: 256 },
  (_, level) => mixed(level / 255),
);

/** For a gradient from the lowest to the highest level. */
export const GRADIENT = STEPS.map(([r, g, b], step) => ({
  offset: step / (STEPS.length - 1),
  colour: `rgb(${r} ${g} ${b})`,
}));

export interface Picture {
  width: number;
  height: number;
  rgba: Uint8ClampedArray<ArrayBuffer>;
}

const decoded = new WeakMap<RadarMap, Uint8Array>();

/** The map's levels, row by row. */
export function levels(map: RadarMap): Uint8Array {
  const known = decoded.get(map) ?? Uint8Array.from(atob(map.cells), (char) => char.charCodeAt(0));
  decoded.set(map, known);
  return known;
}

function paint({ rgba }: Picture, pixel: number, level: number): void {
  const colour = LEVELS[level];
  if (!colour) return;
  rgba[4 * pixel] = colour[0];
  rgba[4 * pixel + 1] = colour[1];
  rgba[4 * pixel + 2] = colour[2];
  rgba[4 * pixel + 3] = 255;
}

function empty(width: number, height: number): Picture {
  return { width, height, rgba: new Uint8ClampedArray(4 * width * height) };
}

/** A pixel for each cell, the first row at the bottom. */
export function upright(map: RadarMap): Picture {
  const [cells, picture] = [levels(map), empty(map.columns, map.rows)];
  for (let row = 0; row < map.rows; row++)
    for (let column = 0; column < map.columns; column++)
      paint(picture, (map.rows - 1 - row) * map.columns + column, cells[row * map.columns + column] ?? 0);
  return picture;
}

/** From above: the radar at the middle of the lower edge, its boresight up; rows are range, columns the azimuth's sine. */
export function fan(map: RadarMap, width: number, height: number, m_per_px: number): Picture {
  const [cells, picture] = [levels(map), empty(width, height)];
  for (let y = 0; y < height; y++) {
    for (let x = 0; x < width; x++) {
      const [right_m, forward_m] = [(x + 0.5 - width / 2) * m_per_px, (height - y - 0.5) * m_per_px];
      const range_m = Math.hypot(right_m, forward_m);
      const row = Math.round((range_m - map.first_row) / map.row_step);
      const column = Math.round((right_m / range_m - map.first_column) / map.column_step);
      if (row < 0 || row >= map.rows || column < 0 || column > map.columns) continue;
      // The FFT's axis is a ring: what follows its last cell is its first.
      paint(picture, y * width + x, cells[row * map.columns + (column % map.columns)] ?? 0);
    }
  }
  return picture;
}

/** Power in dB at a place of the map's axes; null beside it. */
export function powerAt(map: RadarMap, at_row: number, at_column: number): number | null {
  const row = Math.round((at_row - map.first_row) / map.row_step);
  const column = Math.round((at_column - map.first_column) / map.column_step);
  if (row < 0 || row >= map.rows || column < 0 || column >= map.columns) return null;
  const level = levels(map)[row * map.columns + column] ?? 0;
  return map.floor_db + (level / 255) * (map.top_db - map.floor_db);
}

/** From half a cell before the first to half a cell behind the last. */
export const spanOfRows = (map: RadarMap): [number, number] => span(map.first_row, map.row_step, map.rows);
export const spanOfColumns = (map: RadarMap): [number, number] =>
  span(map.first_column, map.column_step, map.columns);

function span(first: number, step: number, count: number): [number, number] {
  return [first - step / 2, first + step * (count - 0.5)];
}
