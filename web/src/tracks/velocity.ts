import type { Track, VelocityCone } from "../messages";
import { RADIUS, place, type Place } from "../obstacles/polar";

/** The velocity display's geometry: velocities over ground as places, the nose up, standing still at (0, 0). */

export type Velocity = readonly [east_m_s: number, north_m_s: number];

/** Speeds that the rim may stand for. */
const RIMS_M_S = [2, 4, 6, 8, 10, 15, 20, 30, 40] as const;
/** The rim stands for the vehicle's limit; only a speed well beyond that makes it stand for more. */
const LEEWAY = 1.15;
const DEG = 180 / Math.PI;

export const speed_m_s = ([east, north]: Velocity) => Math.hypot(east, north);

export function rimOf(limit_m_s: number, own: Velocity | null): number {
  const largest = Math.max(limit_m_s, own ? speed_m_s(own) / LEEWAY : 0);
  return RIMS_M_S.find((rim) => rim >= largest) ?? RIMS_M_S[RIMS_M_S.length - 1]!;
}

/** How a display is turned and scaled. */
export interface Scale {
  rim_m_s: number;
  /** 0 where the heading is unknown: north is up then. */
  heading_deg: number;
}

const bearingOf = ([east, north]: Velocity) => Math.atan2(east, north) * DEG;

export const velocityPlace = (velocity: Velocity, { rim_m_s, heading_deg }: Scale): Place =>
  place(bearingOf(velocity) - heading_deg, (speed_m_s(velocity) / rim_m_s) * RADIUS);

/** A velocity as the tip of its arrow; what is faster than the rim ends there, marked. */
export interface Tip extends Place {
  isBeyond: boolean;
  off_nose_deg: number;
}

export function tipOf(velocity: Velocity, scale: Scale): Tip {
  const share = speed_m_s(velocity) / scale.rim_m_s;
  const off_nose_deg = bearingOf(velocity) - scale.heading_deg;
  return { ...place(off_nose_deg, Math.min(1, share) * RADIUS), isBeyond: share > 1, off_nose_deg };
}

/** Edges are drawn with so many degrees between two corners beyond the rim. */
const STEP_DEG = 30;

/** All velocities that lead into it, as a closed path that reaches beyond the rim: it is clipped there. */
export function conePath(cone: VelocityCone, scale: Scale): string {
  const apex = velocityPlace(cone.apex_enu_m_s, scale);
  const far = 2 * (Math.hypot(apex.x, apex.y) + RADIUS);
  const steps = Math.max(1, Math.ceil((2 * cone.half_angle_deg) / STEP_DEG));
  const corners = Array.from({ length: steps + 1 }, (_, index) => {
    const side_deg = cone.half_angle_deg * ((2 * index) / steps - 1);
    const { x, y } = place(cone.axis_deg + side_deg - scale.heading_deg, far);
    return `L${(apex.x + x).toFixed(1)} ${(apex.y + y).toFixed(1)}`;
  });
  return `M${apex.x.toFixed(1)} ${apex.y.toFixed(1)}${corners.join("")}Z`;
}

const turned_deg = (value_deg: number) => ((((value_deg + 180) % 360) + 360) % 360) - 180;

/** Whether a velocity lies inside the cone. */
export function leadsInto(cone: VelocityCone, velocity: Velocity): boolean {
  const relative: Velocity = [velocity[0] - cone.apex_enu_m_s[0], velocity[1] - cone.apex_enu_m_s[1]];
  if (speed_m_s(relative) === 0) return cone.half_angle_deg >= 90;
  return Math.abs(turned_deg(bearingOf(relative) - cone.axis_deg)) < cone.half_angle_deg;
}

const LABEL_RADIUS = 0.78 * RADIUS;

/** Where a cone's number is written: on its axis, near the rim; null where the axis misses the display. */
export function conePlace(cone: VelocityCone, scale: Scale): Place | null {
  const apex = velocityPlace(cone.apex_enu_m_s, scale);
  const { x, y } = place(cone.axis_deg - scale.heading_deg, 1);
  const along = apex.x * x + apex.y * y;
  const inside = along ** 2 - (apex.x ** 2 + apex.y ** 2 - LABEL_RADIUS ** 2);
  if (inside < 0) return null;
  const step = Math.sqrt(inside) - along;
  return step < 0 ? null : { x: apex.x + step * x, y: apex.y + step * y };
}

/** Rings between stillness and the rim, the rim last. */
export function speedRings(rim_m_s: number): number[] {
  const count = rim_m_s === 15 || rim_m_s === 30 || rim_m_s === 6 ? 3 : rim_m_s === 10 ? 5 : 4;
  return Array.from({ length: count }, (_, index) => (rim_m_s * (index + 1)) / count);
}

/** What matters first: what will come too near, what moves, what is near. */
export function inUrgency(tracks: readonly Track[]): Track[] {
  const rank = (track: Track) => (track.dangerous ? 0 : track.moving ? 1 : 2);
  return [...tracks].sort((a, b) => rank(a) - rank(b) || a.range_m - b.range_m);
}
