import type { Failed } from "../store/reach";
import type { LinkStatus, VehicleState } from "../messages";
import { DASH, number, percent, withUnit } from "../format";

/** The vehicle in a few words, as status bar and panels say them. */

const FIXES: Record<VehicleState["gnss_fix"], string> = {
  none: "No GNSS",
  no_fix: "No fix",
  "2d": "2D fix",
  "3d": "3D fix",
  dgps: "DGPS",
  rtk_float: "RTK float",
  rtk_fixed: "RTK fixed",
};

export type Level = "neutral" | "near" | "bad";

/** A receiver of which nothing was heard yet, as right after the link began, is not one that has no fix. */
const isFixHeard = (state: VehicleState | null): state is VehicleState =>
  state !== null && state.gnss_t_mono_s !== null;

export const fixWord = (state: VehicleState | null) => (isFixHeard(state) ? FIXES[state.gnss_fix] : DASH);

export function fixLevel(state: VehicleState | null): Level {
  if (!isFixHeard(state)) return "neutral";
  if (state.gnss_fix === "none" || state.gnss_fix === "no_fix") return "bad";
  return state.gnss_fix === "2d" ? "near" : "neutral";
}

/** Below a quarter it is time to go home, below a seventh too late for much else. */
const LOW_SHARE = 0.25;
const EMPTY_SHARE = 0.15;

export function batteryLevel(state: VehicleState | null): Level {
  const share = state?.battery_share ?? null;
  if (share === null) return "neutral";
  return share < EMPTY_SHARE ? "bad" : share < LOW_SHARE ? "near" : "neutral";
}

export function batteryWord(state: VehicleState | null): string {
  if (!state) return DASH;
  return state.battery_share === null ? withUnit(state.battery_v, "V", 1) : percent(state.battery_share);
}

/** "AUTO 12/96": the mode, and the item flown to. */
export function modeWord(state: VehicleState | null): string {
  if (!state) return DASH;
  const mode = state.mode || "No mode yet";
  const flies = /AUTO|MISSION/i.test(mode) && state.mission_item !== null && state.mission_items;
  return flies ? `${mode} ${number(state.mission_item)}/${number(state.mission_items)}` : mode;
}

export function armedWord(state: VehicleState | null): string {
  if (!state) return "";
  if (state.critical) return "Failsafe";
  if (!state.armed) return "Disarmed";
  if (state.landed === "on_ground") return "Armed, on the ground";
  return { taking_off: "Taking off", in_air: "In the air", landing: "Landing" }[state.landed ?? "in_air"];
}

export interface LinkWords {
  text: string;
  note: string;
  level: Level;
}

const FAILED: Record<Failed, string> = { server: "No server", link: "Link failed" };

/** What the link is worth: quality and round trip, or how long it has been silent. */
export function linkWords(
  status: LinkStatus | null,
  silence_s: number | null,
  state: LinkStatus["state"] = status?.state ?? "none",
  failed: Failed | null = null,
  late_s: number | null = null,
): LinkWords {
  if (!status || state === "none" || !status.adopted)
    return { text: "No vehicle", note: "", level: "neutral" };
  const silent = silence_s === null ? "" : withUnit(Math.floor(silence_s), "s");
  if (failed) return { text: FAILED[failed], note: silent, level: "bad" };
  if (late_s !== null) return { text: "Page late", note: withUnit(late_s, "s"), level: "bad" };
  if (state === "lost") return { text: "Link lost", note: silent, level: "bad" };
  if (state === "stale") return { text: "Silent", note: silent, level: "near" };
  const note = status.round_trip_s === null ? "" : withUnit(status.round_trip_s * 1000, "ms");
  const isPoor = status.quality !== null && status.quality < POOR_QUALITY;
  return {
    text: status.quality === null ? "Link" : percent(status.quality),
    note,
    level: isPoor ? "near" : "neutral",
  };
}

const POOR_QUALITY = 0.8;

const NODE_WORDS: Readonly<Record<string, string>> = {
  link: "Vehicle link",
  recorder: "Recorder",
  replay: "Replay",
  simulator: "Simulator",
  sensors: "Simulated sensors",
  radar: "Radar map",
  vision: "Camera map",
  ranges: "Range finder map",
};

export const nodeWord = (name: string) => NODE_WORDS[name] ?? name;
