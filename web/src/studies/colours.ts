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
