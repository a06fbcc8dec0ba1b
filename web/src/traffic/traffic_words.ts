import { number, withUnit } from "../format";
import type { Aircraft, TrafficStatus } from "../messages";

/** Other aircraft in a few words, as pilots say them. */

export const SOURCE_WORDS: Record<Aircraft["source"], string> = {
  adsb: "ADS-B",
  remote_id: "remote ID",
  utm: "UTM",
};

const DATUM_WORDS: Record<Aircraft["alt_datum"], string> = {
  ellipsoid: "above the WGS84 ellipsoid",
  gnss: "by GNSS, from the sea's level or the ellipsoid",
  pressure: "by pressure",
  unknown: "",
};

/** A position that is older is shown as old. */
export const OLD_S = 5;
/** Nobody waits for what is farther off. */
const SOON_S = 600;

/** In metres below a kilometre, from there on in kilometres. */
export function away(value_m: number | null): string {
  if (value_m === null) return "place ?";
  if (value_m < 995) return withUnit(10 * Math.round(value_m / 10), "m");
  return withUnit(value_m / 1000, "km", value_m < 9950 ? 1 : 0);
}

/** "2 o'clock" of the nose. */
export function oClock(bearing_deg: number, heading_deg: number | null): string {
  if (heading_deg === null) return `bearing ${String(Math.round(bearing_deg) % 360).padStart(3, "0")}°`;
  const hour = ((Math.round((bearing_deg - heading_deg) / 30) % 12) + 12) % 12;
  return `${hour === 0 ? 12 : hour} o'clock`;
}

/** "+80 m"; with a question mark where it may as well be on the other side. */
export function height({ height_m, height_within_m }: Aircraft): string {
  if (height_m === null) return "unknown";
  const whole = 10 * Math.round(height_m / 10);
  const sign = whole < 0 ? "" : "+";
  return `${sign}${withUnit(whole, "m")}${height_within_m < Math.abs(height_m) ? "" : " ?"}`;
}

/** "closing 35 s" */
export function closing({ closing_m_s, closest_in_s }: Aircraft): string {
  if (closing_m_s === null) return "course ?";
  if (closing_m_s <= 0 || closest_in_s === null) return "going away";
  return closest_in_s > SOON_S ? "closing" : `closing ${withUnit(closest_in_s, "s")}`;
}

const TRUST_WORDS: Record<Aircraft["trust"], string> = {
  other: "",
  own: "this vehicle",
  echo: "taken for this vehicle's own transponder: not warned of",
};

function heightWords(it: Aircraft): string {
  if (it.height_m === null) return "height unknown: counts as yours";
  const size = withUnit(10 * Math.round(Math.abs(it.height_m) / 10), "m");
  const side = it.height_m < 0 ? "below" : "above";
  const within = withUnit(10 * Math.ceil(it.height_within_m / 10), "m");
  return `${size} ${side}, ${DATUM_WORDS[it.alt_datum]}, within ${within}`;
}

function courseWords({ closing_m_s, closest_m, closest_in_s }: Aircraft): string {
  if (closing_m_s === null || closest_m === null || closest_in_s === null) return "course or speed unknown";
  if (closing_m_s <= 0) return "going away";
  const soon = closest_in_s > SOON_S ? "" : ` in ${withUnit(closest_in_s, "s")}`;
  return `closing at ${withUnit(closing_m_s, "m/s")}, closest ${away(closest_m)}${soon}`;
}

/** All that is known of one, for the line below the rows. */
export function aircraftWords(it: Aircraft, heading_deg: number | null, more_s: number): string {
  const age_s = it.age_s + more_s;
  const parts = [
    it.bearing_deg === null ? "your own position is unknown" : oClock(it.bearing_deg, heading_deg),
    ...(it.distance_m === null ? [] : [away(it.distance_m)]),
    heightWords(it),
    it.on_ground ? "on the ground" : courseWords(it),
    ...(it.emergency ? ["in an emergency"] : []),
    ...(TRUST_WORDS[it.trust] ? [TRUST_WORDS[it.trust]] : []),
    `heard ${withUnit(age_s, "s")} ago, within ${away(it.within_m)}`,
  ];
  const kind = it.kind ? `, ${it.kind}` : "";
  return `${it.name}${kind} (${SOURCE_WORDS[it.source]}): ${parts.join("; ")}.`;
}

/** What is not in the rows. */
export function leftOut(status: TrafficStatus, rows: number): string {
  const more = Math.max(0, status.aircraft.length - rows) + status.hidden;
  const parts = [
    ...(more > 0 ? [`${number(more)} more`] : []),
    ...(status.filtered > 0 ? [`${number(status.filtered)} too far or high to show`] : []),
    ...(status.crowded_out > 0 ? [`${number(status.crowded_out)} farther ones not kept`] : []),
  ];
  return parts.length > 0 ? `And ${parts.join(", ")}.` : "";
}
