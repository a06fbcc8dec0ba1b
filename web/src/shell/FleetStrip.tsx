import { useLayoutEffect, useRef } from "preact/hooks";
import { duration, number, withUnit } from "../format";
import type { VehicleDoc } from "../messages";
import { acknowledgeElsewhere, active, calling, fleet } from "../store/fleet";
import { failed, late_s } from "../store/reach";
import { stations } from "../store/stations";
import { chooseVehicle } from "../store/stream";
import { Button } from "../ui/Button";
import { Icon } from "../ui/Icon";
import { OtherStations } from "./OtherStations";

function linkWord({ link, silent_s }: VehicleDoc): string {
  if (link === "none") return "not connected";
  if (link === "live") return "";
  return silent_s === null ? "not heard" : `silent for ${duration(silent_s)}`;
}

/** What is seen at a glance of each, also of those that are not shown. */
function facts(vehicle: VehicleDoc, isPast: boolean): string {
  const { mode, armed, alt_rel_home_m, battery_share } = vehicle;
  const known = [
    isPast ? "as last heard" : linkWord(vehicle),
    mode,
    armed ? "armed" : "disarmed",
    alt_rel_home_m === null ? "" : withUnit(alt_rel_home_m, "m"),
    battery_share === null ? "" : `${number(100 * battery_share)} %`,
  ];
  return (vehicle.link === "none" ? known.slice(0, 1) : known).filter(Boolean).join(" · ");
}

function Vehicle({ vehicle }: { vehicle: VehicleDoc }) {
  // Without the server, or behind a slow line, nobody tells what has become of it.
  const isPast = failed.value === "server" || late_s.value !== null;
  const level = vehicle.alarm ? "bad" : vehicle.link === "stale" || vehicle.link === "lost" ? "near" : "";
  const holder = vehicle.holder ? `${vehicle.holder} is in charge` : "Nobody is in charge";
  return (
    <button
      type="button"
      class={`fleet-vehicle ${level} ${isPast ? "old" : ""}`}
      aria-pressed={vehicle.number === active.value}
      title={`${facts(vehicle, isPast)}. ${holder}${vehicle.plan_name && `; on board: ${vehicle.plan_name}`}`}
      data-testid={`vehicle-${vehicle.number}`}
      onClick={() => chooseVehicle(vehicle.number)}
    >
      <Icon name={vehicle.alarm ? "warning" : "drone"} size={16} />
      <kbd>{vehicle.number}</kbd>
      <strong>{vehicle.name}</strong>
      <span class="fleet-facts">{facts(vehicle, isPast)}</span>
    </button>
  );
}

/** What is wrong with vehicles that this page does not show, in every view. */
function Elsewhere() {
  const [first, ...others] = calling.value;
  if (!first) return null;
  const text = first.alarm?.text ?? "";
  return (
    <p class="fleet-alarm" role="alert" data-testid="fleet-alarm">
      <Icon name="warning" size={20} />
      <span>
        {!text.startsWith(`${first.name} `) && <strong>{first.name}: </strong>}
        {text}
        {others.length > 0 && ` See also: ${others.map(({ name }) => name).join(", ")}.`}
      </span>
      {first.number !== active.value && (
        <Button testid="fleet-show" onClick={() => chooseVehicle(first.number)}>
          Show {first.name}
        </Button>
      )}
      <Button
        icon="check"
        title="The alarm stops (K)"
        testid="fleet-acknowledge"
        onClick={acknowledgeElsewhere}
      >
        Seen
      </Button>
    </p>
  );
}

/** However many rows they need: what is said of the safety buttons stands below the last one. */
function tellHeight(rows: HTMLElement) {
  const observer = new ResizeObserver(() =>
    document.documentElement.style.setProperty("--fleet-height", `${rows.offsetHeight}px`),
  );
  observer.observe(rows);
  return () => observer.disconnect();
}

function Rows() {
  const rows = useRef<HTMLDivElement>(null);
  useLayoutEffect(() => (rows.current ? tellHeight(rows.current) : undefined), []);
  return (
    <div class="fleet-vehicles" ref={rows}>
      {fleet.value.map((vehicle) => (
        <Vehicle key={vehicle.number} vehicle={vehicle} />
      ))}
    </div>
  );
}

/** All vehicles, where there are several: which one is shown, and one press to show another; and other stations'. */
export function FleetStrip() {
  const isOne = fleet.value.length < 2;
  if (isOne && stations.value === null) return null;
  return (
    <nav class="fleet" aria-label="Vehicles" data-testid="fleet">
      {!isOne && <Rows />}
      <Elsewhere />
      <OtherStations />
    </nav>
  );
}
