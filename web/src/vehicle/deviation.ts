import type { AvoidanceStatus, VehicleState } from "../messages";

/** How far beside the planned line the vehicle may be, and where that is on a bar. */

/** Where no plan says how far the autopilot may depart from its line. */
const USUAL_M = 1;

/** The radius of the tube for which the plan's clearance is proved. */
export const tolerance_m = (following_m: number | null | undefined) =>
  following_m === null || following_m === undefined || following_m <= 0 ? USUAL_M : following_m;

export type Verdict = "within" | "beyond" | "far" | "unknown";

export function verdictOf(error_m: number | null | undefined, allowed_m: number): Verdict {
  if (error_m === null || error_m === undefined || !Number.isFinite(error_m)) return "unknown";
  const size = Math.abs(error_m);
  return size <= allowed_m ? "within" : size <= 2 * allowed_m ? "beyond" : "far";
}

/** Whether the plan is being flown: on the ground, and on the way up or home, nothing is amiss off its line. */
export function followsPlan(state: Pick<VehicleState, "armed" | "landed" | "mode"> | null): boolean {
  if (!state?.armed || (state.landed !== "in_air" && state.landed !== null)) return false;
  return /AUTO|GUIDED|MISSION|OFFBOARD/i.test(state.mode);
}

export interface Flown {
  height_error_m: number | null;
  /** How much higher than the plan it is meant to fly. */
  raised_m: number;
  /** On the way up or past something, nothing is amiss off the line. */
  isOnLine: boolean;
}

const NOT_ON_LINE: ReadonlySet<AvoidanceStatus["state"]> = new Set([
  "holding",
  "climbing",
  "manoeuvre",
  "ceiling",
]);

/** The error against what is flown, the plan and what avoidance flies above it, from the one against the plan. */
export function againstFlown(
  height_error_m: number | null,
  { state, height_offset_m: raised_m }: Pick<AvoidanceStatus, "state" | "height_offset_m">,
): Flown {
  const error_m = height_error_m === null ? null : height_error_m - raised_m;
  return { height_error_m: error_m, raised_m, isOnLine: !NOT_ON_LINE.has(state) };
}

/** The bar reaches this many tolerances to either side. */
export const REACH = 3;

/** The marker's place on the bar, 0 (left end) to 1 (right end); beyond the ends it stays there. */
export function markerShare(error_m: number, allowed_m: number): number {
  const share = 0.5 + error_m / (2 * REACH * allowed_m);
  return Math.min(1, Math.max(0, share));
}
