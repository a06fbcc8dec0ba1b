import { computed, signal } from "@preact/signals";
import { metres, number, withUnit } from "../format";
import type { OtherStationDoc, OtherVehicleDoc, StationsMessage } from "../messages";
import { now_ms } from "./clock";
import { serverNow_s } from "./server_clock";

/** Other stations and their vehicles, which only their own stations command; null where none are met. */
export const stations = signal<StationsMessage | null>(null);

let received_ms = 0;

export function takeStations(message: StationsMessage, at_ms: number): void {
  received_ms = at_ms;
  stations.value = message;
}

export const forgetStations = () => {
  stations.value = null;
};

/** Since the ages in the newest message were true: what waited on a slow line, and what has passed here since. */
export function sinceTold_s(): number {
  const told_s = stations.value?.now_mono_s;
  if (told_s === undefined) return 0;
  const least_s = Math.max(0, now_ms.value - received_ms) / 1000;
  const server_s = serverNow_s(now_ms.value);
  return server_s === null ? least_s : Math.max(least_s, server_s - told_s);
}

/** Whether its position says no more where it is; of an age that is not known the station said so. */
export const isOld = ({ is_old, age_s }: OtherVehicleDoc): boolean =>
  is_old || (age_s !== null && age_s + sinceTold_s() > (stations.value?.old_s ?? 0));

/** Its height, and above what; of several the one that tells most about the ground. */
function height({ alt_surface_m, alt_rel_home_m, alt_amsl_m }: OtherVehicleDoc): string {
  if (alt_surface_m !== null) return `${metres(alt_surface_m, 0)} above ground`;
  if (alt_rel_home_m !== null) return `${metres(alt_rel_home_m, 0)} above its home`;
  return alt_amsl_m === null ? "height ?" : `${metres(alt_amsl_m, 0)} AMSL`;
}

/** How old its position is by now, at the worse end. */
function age({ age_s, lat_deg }: OtherVehicleDoc): string {
  if (lat_deg === null) return "no position";
  if (age_s === null) return "age ?";
  const by_now_s = age_s + sinceTold_s();
  return `${withUnit(by_now_s, "s", by_now_s < 10 ? 1 : 0)} old`;
}

const PHASES: Partial<Record<string, string>> = {
  arming: "is being armed",
  taking_off: "takes off",
  flying: "under way",
  paused: "holds",
  returning: "returns",
  landed: "landed",
  interrupted: "broken off",
};

/** Who commands it at its own station: whom to ask for by name when that one is called. */
export function inCharge({ in_charge, in_charge_silent }: OtherVehicleDoc): string {
  if (!in_charge) return "nobody in charge";
  return `${in_charge} in charge${in_charge_silent ? ", not heard there" : ""}`;
}

/** Age and height first: what is old says little else. What is cut off in a narrow row the pointer shows. */
export function words(vehicle: OtherVehicleDoc): string {
  const { ground_speed_m_s, mode, armed, phase, battery_share } = vehicle;
  const speed = ground_speed_m_s === null ? "" : withUnit(ground_speed_m_s, "m/s", 1);
  const battery = battery_share === null ? "" : `${number(100 * battery_share)} %`;
  return [
    age(vehicle),
    height(vehicle),
    inCharge(vehicle),
    speed,
    mode,
    armed ? "armed" : "disarmed",
    PHASES[phase] ?? "",
    battery,
  ]
    .filter(Boolean)
    .join(" · ");
}

/** Of a lost station its own sentence stands for all that it flew: what each of them said last is not said again. */
const wrongVehicles = ({ name, state, vehicles }: OtherStationDoc) =>
  state === "lost"
    ? []
    : vehicles
        .filter((each) => each.text)
        .map((each) => `${each.name} (${name} ${each.number}): ${each.text}`);

/** What is wrong, the worst first: the way to the others, without which all of them are lost; stations; vehicles. */
export const wrong = computed(() => {
  const message = stations.value;
  if (!message) return [];
  const told = message.stations.map(({ text }) => text);
  return [message.text, ...told, ...message.stations.flatMap(wrongVehicles)].filter(Boolean);
});
