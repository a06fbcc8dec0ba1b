import type { MissionConflict, PerceptionStatus } from "../messages";
import type { SensorName } from "../store/obstacles";

export interface Ahead {
  conflict: (MissionConflict & { sensor: SensorName }) | null;
  /** Length of the corridor that is searched; 0: there is no mission to search along. */
  corridor_m: number;
  isCorridorOccupied: boolean;
}

/** The first conflict on the mission ahead by any sensor that watches, and how far the corridor reaches. */
export function aheadOf(watching: readonly PerceptionStatus[]): Ahead {
  const conflicts = watching.flatMap((status) =>
    status.conflict ? [{ ...status.conflict, sensor: status.sensor }] : [],
  );
  const first = conflicts.sort((a, b) => a.ahead_m - b.ahead_m)[0];
  return {
    conflict: first ?? null,
    corridor_m: Math.max(0, ...watching.map((status) => status.corridor_m)),
    isCorridorOccupied: watching.some((status) => status.corridor_occupied),
  };
}
