import type { Obstacle, PerceptionStatus, Region } from "../messages";

/** The polar display's geometry, in its own units: x right, y down, own ship at (0, 0), the nose up. */

export const RADIUS = 96;

/** Distances that the rim may stand for. */
export const RANGES_M = [10, 20, 40, 80, 120] as const;
export type Range_m = (typeof RANGES_M)[number];

export const nextRange = (range_m: number, step: 1 | -1): Range_m | null =>
  RANGES_M[RANGES_M.findIndex((known) => known >= range_m) + step] ?? null;

const RAD = Math.PI / 180;

export interface Place {
  x: number;
  y: number;
}

/** Where something lies that bears so far clockwise from the nose. */
export function place(off_nose_deg: number, radius: number): Place {
  return { x: radius * Math.sin(off_nose_deg * RAD), y: -radius * Math.cos(off_nose_deg * RAD) };
}

const at = (off_nose_deg: number, radius: number) => {
  const { x, y } = place(off_nose_deg, radius);
  return `${x.toFixed(1)} ${y.toFixed(1)}`;
};

/** Four rings, or three where the distances then are rounder. */
export function rings(range_m: number): number[] {
  const count = range_m % 30 === 0 ? 3 : 4;
  return Array.from({ length: count }, (_, index) => (range_m * (index + 1)) / count);
}

export const SWEEP_STEP_DEG = 5;

export interface Arc {
  path: string;
  distance_m: number;
}

/** The nearest voxel of each direction as an arc; none for what lies beyond the rim. */
export function sweepArcs(sweep_m: readonly (number | null)[], range_m: number): Arc[] {
  return sweep_m.flatMap((distance_m, index) => {
    if (distance_m === null || distance_m > range_m) return [];
    const radius = (distance_m / range_m) * RADIUS;
    const middle_deg = index * SWEEP_STEP_DEG;
    const half_deg = SWEEP_STEP_DEG / 2;
    const path = `M${at(middle_deg - half_deg, radius)}A${radius.toFixed(1)} ${radius.toFixed(1)} 0 0 1 ${at(middle_deg + half_deg, radius)}`;
    return [{ path, distance_m }];
  });
}

/** The searched sector as a closed path; what lies beyond the rim is cut there. */
export function sector(region: Pick<Region, "depth_m" | "fov_rad">, range_m: number): string {
  const radius = Math.min(1, region.depth_m / range_m) * RADIUS;
  const half_deg = region.fov_rad / RAD / 2;
  const large = half_deg > 90 ? 1 : 0;
  return `M0 0L${at(-half_deg, radius)}A${radius.toFixed(1)} ${radius.toFixed(1)} 0 ${large} 1 ${at(half_deg, radius)}Z`;
}

/** Over the ground, from where the sector had its tip; without one, the distance in space. */
export function groundDistance_m(obstacle: Obstacle, region: Region | null): number {
  if (!region) return obstacle.distance_m;
  return Math.hypot(obstacle.enu_m[0] - region.enu_m[0], obstacle.enu_m[1] - region.enu_m[1]);
}

export interface Blip extends Place {
  /** Beyond the rim: it is marked there. */
  isBeyond: boolean;
  off_nose_deg: number;
  distance_m: number;
  height_difference_m: number;
}

export function blips(status: PerceptionStatus, range_m: number): Blip[] {
  return status.obstacles.map((obstacle) => {
    const distance_m = groundDistance_m(obstacle, status.region);
    const radius = Math.min(1, distance_m / range_m) * RADIUS;
    return {
      ...place(obstacle.off_nose_deg, radius),
      isBeyond: distance_m > range_m,
      off_nose_deg: obstacle.off_nose_deg,
      distance_m,
      height_difference_m: obstacle.height_difference_m,
    };
  });
}

/** Height differences are written beside so many, and not where another one is written already. */
const MOST_LABELS = 4;
const LABEL_ROOM = { x: 34, y: 15 };

export function labelled<T extends Place>(nearestFirst: readonly T[]): T[] {
  const chosen: T[] = [];
  for (const blip of nearestFirst) {
    const isFree = chosen.every(
      (other) => Math.abs(other.x - blip.x) > LABEL_ROOM.x || Math.abs(other.y - blip.y) > LABEL_ROOM.y,
    );
    if (isFree && chosen.length < MOST_LABELS) chosen.push(blip);
  }
  return chosen;
}

export interface Nearest {
  distance_m: number;
  off_nose_deg: number;
}

/** The nearest thing around, of any sensor: in the regions or out of them. */
export function nearestOf(statuses: readonly PerceptionStatus[]): Nearest | null {
  const all = statuses.flatMap((status) => [
    ...status.obstacles.map(({ distance_m, off_nose_deg }) => ({ distance_m, off_nose_deg })),
    ...status.sweep_m.flatMap((distance_m, index) => {
      const clockwise_deg = index * SWEEP_STEP_DEG;
      const off_nose_deg = clockwise_deg > 180 ? clockwise_deg - 360 : clockwise_deg;
      return distance_m === null ? [] : [{ distance_m, off_nose_deg }];
    }),
  ]);
  return all.reduce<Nearest | null>(
    (best, one) => (best && best.distance_m <= one.distance_m ? best : one),
    null,
  );
}
