import { computed, signal } from "@preact/signals";
import { metres, withUnit } from "../format";
import type { OtherStationDoc, OtherVehicleDoc, StationsMessage } from "../messages";

/** Other stations and their vehicles, which only their own stations command; null where none are met. */
export const stations = signal<StationsMessage | null>(null);

export const forgetStations = () => {
  stations.value = null;
};

/** Its height, and above what; of several the one that tells most about the ground. */
function height({ alt_surface_m, alt_rel_home_m, alt_amsl_m }: OtherVehicleDoc): string {
  if (alt_surface_m !== null) return `${metres(alt_surface_m, 0)} above ground`;
  if (alt_rel_home_m !== null) return `${metres(alt_rel_home_m, 0)} above its home`;
  return alt_amsl_m === null ? "height ?" : `${metres(alt_amsl_m, 0)} AMSL`;
}

/** How old its position is, at the worse end. */
function age({ age_s, lat_deg }: OtherVehicleDoc): string {
  if (lat_deg === null) return "no position";
  return age_s === null ? "age ?" : `${withUnit(age_s, "s", age_s < 10 ? 1 : 0)} old`;
}

/** Age and height first: what is old says little else. */
export function words(vehicle: OtherVehicleDoc): string {
  const { ground_speed_m_s, mode, armed } = vehicle;
  const speed = ground_speed_m_s === null ? "" : withUnit(ground_speed_m_s, "m/s", 1);
  return [age(vehicle), height(vehicle), speed, mode, armed ? "armed" : "disarmed"]
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
