/** Numbers as the operator reads them: unit beside each, a dash where nothing is known. */

export const DASH = "–";
const MINUS = "\u2212";
const THIN = "\u202f";

function known(value: number | null | undefined): value is number {
  return value !== null && value !== undefined && Number.isFinite(value);
}

/** Fixed decimals, true minus sign, thousands apart. */
export function number(value: number | null | undefined, decimals = 0): string {
  if (!known(value)) return DASH;
  const [whole = "0", fraction] = Math.abs(value).toFixed(decimals).split(".");
  const digits = whole.length > 4 ? whole.replace(/\B(?=(\d{3})+$)/g, THIN) : whole;
  const text = fraction ? `${digits}.${fraction}` : digits;
  const isZero = Number(`${whole}.${fraction ?? 0}`) === 0;
  return value < 0 && !isZero ? MINUS + text : text;
}

export function withUnit(value: number | null | undefined, unit: string, decimals = 0): string {
  return known(value) ? `${number(value, decimals)}\u00a0${unit}` : DASH;
}

/** Of many things, in few digits: 300,000 and 12.5 M. */
export const many = (value: number) =>
  value < 1e6 ? number(value) : `${number(value / 1e6, value < 1e8 ? 1 : 0)}\u00a0M`;

export const metres = (value: number | null | undefined, decimals = 1) => withUnit(value, "m", decimals);

/** A distance to the ground, rounded down to centimetres: no clearance is flattered. */
export const clearance = (value_m: number | null | undefined) =>
  metres(known(value_m) ? Math.floor(value_m * 100 + 1e-6) / 100 : value_m, 2);

/** A distance that is demanded, rounded up to centimetres: what is read is enough. */
export const demanded = (value_m: number) => metres(Math.ceil(value_m * 100 - 1e-6) / 100, 2);

/** Long lengths in kilometres. */
export function length(value_m: number | null | undefined): string {
  if (!known(value_m)) return DASH;
  return value_m >= 10_000 ? withUnit(value_m / 1000, "km", 2) : metres(value_m, value_m < 100 ? 1 : 0);
}

/** Minutes and seconds: 0:07, 12:30, 1:05:00. */
export function duration(value_s: number | null | undefined): string {
  if (!known(value_s)) return DASH;
  const total = Math.round(value_s);
  const two = (part: number) => String(part).padStart(2, "0");
  const [hours, minutes, seconds] = [Math.floor(total / 3600), Math.floor(total / 60) % 60, total % 60];
  return hours > 0 ? `${hours}:${two(minutes)}:${two(seconds)}` : `${minutes}:${two(seconds)}`;
}

export const percent = (share: number | null | undefined, decimals = 0) =>
  withUnit(known(share) ? share * 100 : null, "%", decimals);

/** Latitude or longitude to 7 decimals (about a centimetre), with a plain minus so that it can be pasted. */
export const degrees = (value: number) => value.toFixed(7);

export const latLon = (place: { lat_deg: number; lon_deg: number }) =>
  `${degrees(place.lat_deg)}, ${degrees(place.lon_deg)}`;

/** The time of day here of a UTC timestamp, or of UTC seconds. */
export function clock(utc: string | number): string {
  const date = new Date(typeof utc === "number" ? utc * 1000 : utc);
  return Number.isNaN(date.getTime()) ? DASH : date.toLocaleTimeString("en-GB");
}

export function day(utc: string): string {
  const time = clock(utc);
  return time === DASH ? DASH : `${new Date(utc).toLocaleDateString("en-CA")} ${time.slice(0, 5)}`;
}

/** How long ago, coarsely: "now", "8 s", "3 min". */
export function age(value_ms: number): string {
  const seconds = Math.max(0, Math.floor(value_ms / 1000));
  if (seconds < 1) return "now";
  return seconds < 100 ? `${seconds} s` : `${Math.floor(seconds / 60)} min`;
}

export function count(value: number, singular: string, plural = `${singular}s`): string {
  return `${number(value)} ${value === 1 ? singular : plural}`;
}

/** A number as typed by people: comma or point, any minus, spaces; null when it is none. */
export function parseNumber(text: string): number | null {
  const plain = text
    .replace(/[\s\u202f\u00a0]/g, "")
    .replace(MINUS, "-")
    .replace(",", ".");
  if (!/^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(plain)) return null;
  const value = Number(plain);
  return Number.isFinite(value) ? value : null;
}

/** A number for an input: as many decimals as it has, at most 7. */
export const editable = (value: number) => String(Number(value.toFixed(7)));

/** A message about a file without the words of the command line: here a form asks for the same. */
export function forConsole(message: string): string {
  return message
    .replace(/: --(cfg FILE|offset-s)/g, ", on the left")
    .replace(/--samples twos-complement or offset-binary/g, "two's complement or offset binary, on the left")
    .replace(/--samples twos-complement takes/g, "“Two's complement” on the left takes")
    .replace(/Leave --samples out/g, "Choose “Told by the samples” on the left")
    .replace(/Use --sensor position2go/g, "Choose the Position2Go on the left")
    .replace(/Leave out --cfg or the sensor/g, "Take its configuration away, or choose the AWR1843")
    .replace(/: --frames (\d+)/g, " (“Only the first frames”: $1)")
    .replace(/; --keep-noise takes them/g, ": “Points called noise count too” takes them")
    .replace(/Leave --(cell-m|z-scale) out, or give metres/g, "Leave it empty, or give metres")
    .replace(/--max-gap-s bridges more, and without --home-alt-amsl-m/g, "with latitude and longitude")
    .replace(/--max-gap-s bridges more/g, "“Gaps bridged” can bridge more")
    .replace(/Leave --frame out/g, "Leave the robot's frame empty")
    .replace(/Map it with --sensor vision/g, "Take it as a camera or lidar")
    .replace(/Give --pose\. /g, "Choose it. ")
    .replace(/ with --[a-z-]+/g, "")
    .replace(/use --z-scale( [\d.]*\d| with the metres of one unit)/g, "declare their unit")
    .replace(/--[a-z-]+ (?=EPSG:)/g, "")
    .replace(/ \(gdal_calc\.py[^)]*\)/g, "");
}

/** A deviation with its direction in words: "0.42 m right". */
export function deviation(value_m: number | null | undefined, words: { more: string; less: string }): string {
  if (!known(value_m)) return DASH;
  const size = metres(Math.abs(value_m), 2);
  if (Math.abs(value_m) < 0.005) return size;
  return `${size} ${value_m > 0 ? words.more : words.less}`;
}

export const degreesOf = (rad: number) => (rad * 180) / Math.PI;

/** A compass bearing with three digits: 074°. */
export function bearing(value_deg: number | null | undefined): string {
  if (!known(value_deg)) return DASH;
  const whole = ((Math.round(value_deg) % 360) + 360) % 360;
  return `${String(whole).padStart(3, "0")}°`;
}

const POINTS = ["N", "NE", "E", "SE", "S", "SW", "W", "NW"] as const;

export function compassPoint(value_deg: number): string {
  return POINTS[((Math.round(value_deg / 45) % 8) + 8) % 8] ?? "";
}

export function bytes(value: number | null | undefined): string {
  if (!known(value)) return DASH;
  if (value < 1000) return withUnit(value, "B");
  const units = ["kB", "MB", "GB", "TB"] as const;
  const step = Math.min(units.length - 1, Math.floor(Math.log10(value) / 3) - 1);
  const scaled = value / 1000 ** (step + 1);
  return withUnit(scaled, units[step] ?? "TB", scaled < 10 ? 1 : 0);
}

/** Minutes and seconds with tenths, for a time line: 3:07.4. */
export function timecode(value_s: number | null | undefined): string {
  if (!known(value_s)) return DASH;
  const tenths = Math.floor(Math.max(0, value_s) * 10 + 1e-6);
  const seconds = String(Math.floor(tenths / 10) % 60).padStart(2, "0");
  return `${Math.floor(tenths / 600)}:${seconds}.${tenths % 10}`;
}

/** The shortest decimal that a vehicle keeps as this number, in single precision where it is one: 0.8, not 0.800000011920929. */
export function asSet(value: number): string {
  if (Math.fround(value) !== value) return String(value);
  const digits = [1, 2, 3, 4, 5, 6, 7, 8, 9].find((n) => Math.fround(Number(value.toPrecision(n))) === value);
  return String(digits === undefined ? value : Number(value.toPrecision(digits)));
}
