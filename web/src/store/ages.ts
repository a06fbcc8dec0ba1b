import { LOST_S, STALE_S, type VehicleMessage, type VehicleState } from "../messages";
import { serverNow_s } from "./server_clock";

/** A message about the vehicle and when, by this page's clock, it came. */
export interface Heard {
  message: VehicleMessage;
  received_ms: number;
}

export type Group = "heartbeat" | "position" | "attitude" | "battery" | "gnss";

const CLOCKS = {
  heartbeat: "heartbeat_t_mono_s",
  position: "position_t_mono_s",
  attitude: "attitude_t_mono_s",
  battery: "battery_t_mono_s",
  gnss: "gnss_t_mono_s",
} as const;

/**
 * Older values than STALE_S are greyed and shown with their age. Batteries and receivers report less often than
 * position and attitude do.
 */
const SLOW: Partial<Record<Group, number>> = { battery: 6, gnss: 3, heartbeat: LOST_S };

const newest = (state: VehicleState) =>
  Math.max(...Object.values(CLOCKS).map((clock) => state[clock] ?? -Infinity));

/**
 * Seconds since a group's last message came; null when none ever did. Live values go on aging while nothing
 * arrives, and what waited on a slow line is as old as the server's clock says. A recording's clock stands still with it: its values are as old as they are behind the newest.
 */
export function age_s(heard: Heard | null, group: Group, now_ms: number): number | null {
  const state = heard?.message.state;
  const at_s = state?.[CLOCKS[group]];
  if (!heard || !state || at_s == null) return null;
  if (heard.message.source === "replay") return Math.max(0, newest(state) - at_s);
  const least_s = heard.message.now_mono_s + Math.max(0, now_ms - heard.received_ms) / 1000;
  return Math.max(0, Math.max(least_s, serverNow_s(now_ms) ?? least_s) - at_s);
}

export function isStale(heard: Heard | null, group: Group, now_ms: number): boolean {
  const seconds = age_s(heard, group, now_ms);
  return seconds === null || seconds > (SLOW[group] ?? STALE_S);
}
