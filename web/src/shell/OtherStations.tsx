import { duration } from "../format";
import type { OtherStationDoc } from "../messages";
import { failed, late_s } from "../store/reach";
import { inCharge, isOld, sinceTold_s, stations, words, wrong } from "../store/stations";
import { Icon } from "../ui/Icon";

function Station({ station, isPast }: { station: OtherStationDoc; isPast: boolean }) {
  const { name, state, silent_s, vehicles } = station;
  const told =
    state === "lost"
      ? `silent for ${duration(silent_s + sinceTold_s())}`
      : vehicles.length
        ? ""
        : "no vehicle";
  return (
    <>
      {told && (
        <li class="old" data-testid={`station-${name}`}>
          <strong>{name}</strong> {told}
        </li>
      )}
      {vehicles.map((vehicle) => (
        <li
          key={vehicle.number}
          class={isOld(vehicle) || isPast ? "old" : ""}
          title={[words(vehicle), vehicle.battery, vehicle.plan, vehicle.text].filter(Boolean).join(". ")}
          data-testid={`other-${name}-${vehicle.number}`}
        >
          <strong>
            {name}: {vehicle.name}
          </strong>{" "}
          {isPast ? `as last heard · ${inCharge(vehicle)}` : words(vehicle)}
        </li>
      ))}
    </>
  );
}

/** Vehicles of other stations, to be looked at: no press commands them. */
export function OtherStations() {
  const message = stations.value;
  if (!message) return null;
  // Without the server, or behind a slow line, nobody tells what has become of them.
  const isPast = failed.value === "server" || late_s.value !== null;
  return (
    <section class="stations" aria-label="Other stations" data-testid="stations">
      {wrong.value.length > 0 && (
        <div class="stations-wrong" role="status">
          {wrong.value.map((text) => (
            <p key={text}>
              <Icon name="warning" size={16} />
              <span>{text}</span>
            </p>
          ))}
        </div>
      )}
      {message.stations.length > 0 && (
        <ul>
          {message.stations.map((station) => (
            <Station key={station.name} station={station} isPast={isPast} />
          ))}
        </ul>
      )}
    </section>
  );
}
