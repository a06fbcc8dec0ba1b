import { DASH, bearing, duration, metres, number, withUnit } from "../format";
import type { AlertDoc, AvoidanceStatus, MissionConflict, Obstacle, ObstacleAlert } from "../messages";
import type { SensorName } from "../store/obstacles";
import { SILENT_S, type Sensed, type Watch } from "../store/sensing";

/** Obstacles, sensors and avoidance in a few words. */

export const SENSOR_WORDS: Record<SensorName, string> = {
  radar: "Radar",
  vision: "Camera",
  ranges: "Range finder",
};

const KIND_WORDS: Record<ObstacleAlert["kind"], string> = {
  obstacle: "obstacle",
  conflict: "conflict on the mission ahead",
  approach: "on a collision course",
  divergence: "positions disagree",
  sensor: "sensor trouble",
  avoidance: "does not watch",
  traffic: "may come too near",
};

/** A small distance in decimetres, a larger one in metres: nobody reads decimetres in a hurry. */
export const distance = (value_m: number) => metres(value_m, value_m < 20 ? 1 : 0);

/** "12° right" of the nose. */
export function offNose(value_deg: number): string {
  const size = Math.round(Math.abs(value_deg));
  if (size === 0) return "dead ahead";
  if (size === 180) return "straight behind";
  return `${size}° ${value_deg > 0 ? "right" : "left"}`;
}

/** "3.2 m higher" than the vehicle. */
export function heightDifference(value_m: number): string {
  if (Math.abs(value_m) < 0.05) return "at your height";
  return `${metres(Math.abs(value_m))} ${value_m > 0 ? "higher" : "lower"}`;
}

/** With its sign always, for where there is no room for words: "+3". */
export function signedHeight(value_m: number): string {
  const whole = Math.round(value_m);
  return `${whole < 0 ? "" : "+"}${number(whole)}`;
}

export const timeTo = (value_s: number | null) =>
  value_s === null ? "not getting nearer" : `contact in ${withUnit(value_s, "s", value_s < 10 ? 1 : 0)}`;

const ageWords = (ago_s: number) => (ago_s < 100 ? withUnit(Math.floor(ago_s), "s") : duration(ago_s));

/** Of what is shown and is not of now. */
export const seenAgo = (ago_s: number | null) => (ago_s === null ? "not now" : `${ageWords(ago_s)} ago`);

/** What is told again every second and was not is no distance of now: how long ago, null where it is of now. */
export function lateAlert_s(alert: ObstacleAlert, now_s: number | null): number | null {
  const ago_s = now_s === null ? 0 : now_s - alert.t_mono_s;
  return ago_s > SILENT_S ? ago_s : null;
}

/** Whose alert it is; avoidance, which several sensors serve, is nobody's, and traffic tells of itself. */
export const alertSensor = ({ sensor, kind }: ObstacleAlert): SensorName | null =>
  kind === "avoidance" || sensor === "traffic" ? null : sensor;

export const alertTitle = (alert: ObstacleAlert) => {
  const sensor = alertSensor(alert);
  const whose = sensor ? SENSOR_WORDS[sensor] : alert.kind === "traffic" ? "Traffic" : "Avoidance";
  return `${whose}: ${KIND_WORDS[alert.kind]}`;
};

/** What is said aloud once, when it begins; its figures go on changing, in silence. */
export function spoken(entry: AlertDoc): string {
  const { alert, over } = entry;
  const title = alertTitle(alert);
  if (over) return `Over. ${title}.`;
  const { obstacle } = alert;
  if (!obstacle) return `${title}. ${alert.text}`;
  const where = `${number(obstacle.distance_m, 1)} metres, ${offNose(obstacle.off_nose_deg)}`;
  return `${title}. ${where}, ${heightDifference(obstacle.height_difference_m)}, ${timeTo(obstacle.time_to_contact_s)}.`;
}

export const bearingWord = (obstacle: Obstacle) =>
  `${offNose(obstacle.off_nose_deg)} · ${bearing(obstacle.bearing_deg)}`;

export type Level = "neutral" | "good" | "near" | "bad";

export const WATCH_WORDS: Record<Watch, { word: string; level: Level }> = {
  waiting: { word: "no frame yet", level: "neutral" },
  running: { word: "watching", level: "neutral" },
  blind: { word: "sees nothing", level: "bad" },
  frozen: { word: "map stands still", level: "bad" },
  stale: { word: "frames have stopped", level: "bad" },
  silent: { word: "silent", level: "bad" },
};

export interface SensorRow {
  rate: string;
  latency: string;
  voxels: string;
  /** Frames that never came and what was refused: empty when there is nothing of it to say. */
  lost: string;
  reasons: readonly string[];
}

export function sensorRow({ status, rate_hz }: Sensed): SensorRow {
  const dropped = status.dropped.filter((entry) => entry.count > 0).sort((a, b) => b.count - a.count);
  const total = dropped.reduce((sum, entry) => sum + entry.count, 0);
  const more = dropped.length > 1 ? " and other reasons" : "";
  const parts = [
    ...(total > 0 ? [`${number(total)} not used: ${dropped[0]?.what}${more}`] : []),
    ...(status.lost_frames > 0 ? [`${number(status.lost_frames)} lost`] : []),
  ];
  return {
    rate: withUnit(rate_hz, "Hz", rate_hz !== null && rate_hz < 10 ? 1 : 0),
    latency: status.latency_s === null ? DASH : withUnit(status.latency_s * 1000, "ms"),
    voxels: number(status.voxels_occupied),
    lost: parts.join(", "),
    reasons: dropped.map((e) => `${number(e.count)} × ${e.what}`),
  };
}

export interface AvoidanceWords {
  word: string;
  level: Level;
  /** What it means, where the server says nothing better. */
  note: string;
}

const AVOIDANCE: Record<AvoidanceStatus["state"], AvoidanceWords> = {
  off: { word: "Off", level: "neutral", note: "You steer clear yourself." },
  blind: { word: "No eyes", level: "bad", note: "No sensor sees ahead: nothing brakes by itself." },
  lost: { word: "Lost", level: "bad", note: "The link has failed: nothing brakes by itself." },
  watching: { word: "Watching", level: "neutral", note: "Climbs by itself over what it sees ahead." },
  holding: { word: "Holding", level: "bad", note: "Braked: what sensors or position say is too old." },
  climbing: { word: "Climbing", level: "near", note: "Until the way ahead is clear." },
  offset: { word: "Higher", level: "near", note: "The rest is flown above the plan." },
  manoeuvre: { word: "On the way past", level: "near", note: "Flies the chosen manoeuvre." },
  released: { word: "Released", level: "near", note: "The pilot has taken over: off for this flight." },
  ceiling: { word: "At its ceiling", level: "bad", note: "It may not climb any further, and holds. Decide." },
};

/** No longer above the plan: the rest was planned and certified again. */
const NEW_LINE: AvoidanceWords = { word: "New line", level: "neutral", note: "The rest is flown in GUIDED." };
const LOW_M = 0.05;

const WATCHES: Record<AvoidanceStatus["by"], string> = {
  climb: AVOIDANCE.watching.note,
  sidestep: "Steps aside by itself past what it follows; climbs where it cannot.",
};

export function avoidanceWords(status: AvoidanceStatus): AvoidanceWords {
  const isHigher = status.height_offset_m >= LOW_M;
  const words = status.state === "offset" && !isHigher ? NEW_LINE : AVOIDANCE[status.state];
  const higher = isHigher ? ` +${metres(status.height_offset_m)}` : "";
  const note = status.state === "watching" ? WATCHES[status.by] : words.note;
  return { ...words, word: words.word + higher, note: status.text || note };
}

/** Faster than the region lets it stop. */
export const isTooFast = (status: AvoidanceStatus, speed_m_s: number | null) =>
  status.enabled &&
  status.largest_speed_m_s !== null &&
  speed_m_s !== null &&
  speed_m_s > status.largest_speed_m_s + 0.05;

/** "in 84 m, 28 s, before item 14". */
export function conflictWhere(conflict: MissionConflict): string {
  const time = conflict.time_s === null ? "" : `, ${withUnit(conflict.time_s, "s")}`;
  return `in ${metres(conflict.ahead_m, 0)}${time}, before item ${conflict.item}`;
}
