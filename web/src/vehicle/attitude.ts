import { degreesOf } from "../format";

/** The attitude indicator's geometry, in its own units: x right, y down, the aircraft at (0, 0). */

export const HALF_WIDTH = 130;
export const HALF_HEIGHT = 70;
export const PER_DEG = 2.4;

/**
 * What moves the world behind the aircraft: nose down moves the horizon up, a bank to the right turns it to the left.
 * The pitch is held where some of the horizon's side still shows which way is up.
 */
export function horizon(roll_rad: number, pitch_rad: number): { turn_deg: number; down: number } {
  const most = HALF_HEIGHT / PER_DEG - 4;
  const pitch_deg = Math.min(most, Math.max(-most, degreesOf(pitch_rad)));
  return { turn_deg: -degreesOf(roll_rad), down: pitch_deg * PER_DEG };
}

export interface Rung {
  /** Of the pitch that it marks, above the horizon positive. */
  pitch_deg: number;
  /** From the horizon: upwards is negative. */
  y: number;
  halfWidth: number;
  label: string;
}

/** The pitch ladder: a long rung each ten degrees, a short one between. */
export function ladder(): Rung[] {
  const rungs: Rung[] = [];
  for (let pitch_deg = -45; pitch_deg <= 45; pitch_deg += 5) {
    if (pitch_deg === 0) continue;
    const isLong = pitch_deg % 10 === 0;
    rungs.push({
      pitch_deg,
      y: -pitch_deg * PER_DEG,
      halfWidth: isLong ? 26 : 12,
      label: isLong ? String(Math.abs(pitch_deg)) : "",
    });
  }
  return rungs;
}

export const ROLL_MARKS_DEG = [-60, -45, -30, -20, -10, 0, 10, 20, 30, 45, 60] as const;

export interface Mark {
  /** From the middle of the tape, to the right positive. */
  x: number;
  label: string;
}

const TAPE_PER_DEG = 1.5;
const NAMES: Readonly<Record<number, string>> = { 0: "N", 90: "E", 180: "S", 270: "W" };

/** The heading tape's marks around a heading: each ten degrees, with a name or number each thirty. */
export function tape(heading_deg: number): Mark[] {
  const reach_deg = HALF_WIDTH / TAPE_PER_DEG;
  const first = Math.ceil((heading_deg - reach_deg) / 10) * 10;
  const marks: Mark[] = [];
  for (let at_deg = first; at_deg <= heading_deg + reach_deg; at_deg += 10) {
    const course = ((at_deg % 360) + 360) % 360;
    const label = course % 30 === 0 ? (NAMES[course] ?? String(course).padStart(3, "0")) : "";
    marks.push({ x: (at_deg - heading_deg) * TAPE_PER_DEG, label });
  }
  return marks;
}
