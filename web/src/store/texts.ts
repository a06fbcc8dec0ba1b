import type { VehicleText } from "../messages";

/** One of the vehicle's messages, with how often it was said in a row. */
export interface TextEntry {
  id: number;
  severity: number;
  text: string;
  first_utc_s: number;
  last_utc_s: number;
  count: number;
  acknowledged: boolean;
}

/** MAV_SEVERITY: emergency, alert and critical stay until somebody acknowledges them. */
export const CRITICAL = 2;
/** The same words again within this time are the same message. */
const REPEAT_S = 120;
const MOST_ENTRIES = 200;

const WORDS = ["Emergency", "Alert", "Critical", "Error", "Warning", "Notice", "Info", "Debug"];

export const severityWord = (severity: number) => WORDS[severity] ?? "Message";

export function severityLevel(severity: number): "bad" | "near" | "neutral" {
  if (severity <= 3) return "bad";
  return severity === 4 ? "near" : "neutral";
}

let nextId = 1;

/** Newest first. A repeat counts up and moves to the top; one that was already here (told again) changes nothing. */
export function withText(entries: readonly TextEntry[], said: VehicleText): readonly TextEntry[] {
  const { severity, text, t_utc_s } = said;
  const same = entries.find((entry) => entry.severity === severity && entry.text === text);
  if (same && t_utc_s <= same.last_utc_s) return entries;
  if (same && t_utc_s - same.last_utc_s <= REPEAT_S) {
    const others = entries.filter((entry) => entry !== same);
    return [{ ...same, count: same.count + 1, last_utc_s: t_utc_s }, ...others];
  }
  const entry: TextEntry = {
    id: nextId++,
    severity,
    text,
    first_utc_s: t_utc_s,
    last_utc_s: t_utc_s,
    count: 1,
    acknowledged: false,
  };
  const at = entries.findIndex((other) => other.last_utc_s <= t_utc_s);
  const place = at < 0 ? entries.length : at;
  return [...entries.slice(0, place), entry, ...entries.slice(place)].slice(0, MOST_ENTRIES);
}

export const isLatched = (entry: TextEntry) => entry.severity <= CRITICAL && !entry.acknowledged;

export function acknowledge(entries: readonly TextEntry[], id: number): readonly TextEntry[] {
  return entries.map((entry) => (entry.id === id ? { ...entry, acknowledged: true } : entry));
}
