import { batch, computed, signal } from "@preact/signals";
import type { ActiveMessage, FleetMessage, VehicleDoc } from "../messages";
import { standing } from "../net/api";
import { forgetFlying } from "./flying";
import { forgetGuided } from "./guided";
import { forgetHome } from "./home";
import { forgetMoving } from "./moving";
import { forgetObstacles, forgetSensing } from "./obstacles";
import { forgetOrders } from "./outcomes";

/** The vehicles of a station that has several: all of them, and the one that this page shows and commands. */

export const active = signal(1);
/** Empty where there is only one. */
export const fleet = signal<readonly VehicleDoc[]>([]);

/** What every request of this page names: no command goes to a vehicle that the page does not show. */
export function takeActive({ vehicle }: ActiveMessage): void {
  standing["Hedgehop-Vehicle"] = String(vehicle);
  if (vehicle === active.value) return;
  batch(() => {
    forgetFlying(active.value, vehicle);
    forgetSensing("live");
    forgetObstacles("live");
    forgetMoving("live");
    forgetGuided();
    forgetHome();
    forgetOrders();
    active.value = vehicle;
  });
}

/** Of an answer that takes a while: whether the page still shows the vehicle that was asked. */
export function stillOf(): () => boolean {
  const asked = active.peek();
  return () => active.peek() === asked;
}

export function takeFleet({ vehicles }: FleetMessage): void {
  fleet.value = vehicles;
  const there = new Set(vehicles.flatMap((each) => (each.alarm ? [keyOf(each)] : [])));
  const left = [...seen.value].filter((key) => there.has(key));
  // What is over and comes again calls again.
  if (left.length < seen.value.size) seen.value = new Set(left);
}

const keyOf = ({ number, alarm }: VehicleDoc) => `${number} ${alarm?.key ?? ""}`;
const seen = signal<ReadonlySet<string>>(new Set());

/** What is wrong with the vehicle that is shown stands elsewhere on the page, but for another one that comes near. */
const isElsewhere = ({ number, alarm }: VehicleDoc) => number !== active.value || alarm?.kind === "near";

const GRAVITY = { loss: 0, near: 1, alert: 2 } as const;
const gravity = ({ alarm }: VehicleDoc) => (alarm ? GRAVITY[alarm.kind] : GRAVITY.alert);

/** Vehicles with which something is wrong that this page does not show and nobody here has seen; the worst first. */
export const calling = computed(() =>
  fleet.value
    .filter((each) => each.alarm && isElsewhere(each) && !seen.value.has(keyOf(each)))
    .sort((one, other) => gravity(one) - gravity(other)),
);

export const isCallingLoss = computed(() => calling.value.some(({ alarm }) => alarm?.kind === "loss"));

/** The one whose words are read, and the other end of the same nearness: the next one is read after it. */
export function acknowledgeElsewhere(): void {
  const alarm = calling.value[0]?.alarm;
  const read = calling.value.filter(
    (each, index) => index === 0 || (alarm?.kind === "near" && each.alarm?.key === alarm.key),
  );
  seen.value = new Set([...seen.value, ...read.map(keyOf)]);
}
