import type { RadarTargetsDoc, SectionDoc } from "../messages";

/** How slices and radar targets are laid onto a panel: metres to pixels, the same both ways. */

export interface Frame {
  /** Pixels a metre. */
  scale: number;
  /** Pixel of 0, 0. */
  x0: number;
  y0: number;
}

export const px = (frame: Frame, right_m: number, up_m: number): [number, number] => [
  frame.x0 + right_m * frame.scale,
  frame.y0 - up_m * frame.scale,
];

/** Round figures on an axis, at least ``apart_px`` from each other. */
export function ticks(from_m: number, to_m: number, scale: number, apart_px: number): number[] {
  const least_m = apart_px / scale;
  const power = 10 ** Math.floor(Math.log10(least_m));
  const step_m = [1, 2, 5, 10].map((times) => times * power).find((step) => step >= least_m) ?? least_m;
  const first = Math.ceil(from_m / step_m - 1e-9);
  const last = Math.floor(to_m / step_m + 1e-9);
  return Array.from({ length: last - first + 1 }, (_, n) => (first + n) * step_m);
}

/** The slice's frame: the vehicle in the middle, as much below it as above unless more of the ground is to be seen. */
export function sectionFrame(doc: SectionDoc, width: number, height: number): Frame {
  const scale = width / (2 * doc.reach_m);
  const vehicle_m = doc.vehicle_up_m ?? 0;
  const under = doc.ground_up_m.filter((up): up is number => up !== null);
  const ground_m = under.length ? Math.min(vehicle_m, under[Math.floor(under.length / 2)] ?? 0) : vehicle_m;
  const span_m = height / scale;
  // A quarter of the panel lies below the ground under the vehicle, unless the vehicle would leave it above.
  const low_m = Math.max(Math.min(ground_m - span_m / 4, vehicle_m - span_m / 3), vehicle_m - 0.8 * span_m);
  return { scale, x0: width / 2, y0: height + low_m * scale };
}

/** The radar's frame: the vehicle at the bottom, all targets up to where the farthest kept one is. */
export function targetsReach_m(doc: RadarTargetsDoc): number {
  const kept = doc.ahead_m.filter((_, n) => doc.kept[n]);
  const far_m = Math.max(10, ...kept.map((ahead) => ahead * 1.1));
  return [10, 20, 40, 80, 125].find((reach) => reach >= far_m) ?? 125;
}
