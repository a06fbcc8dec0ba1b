import { batch, computed, signal } from "@preact/signals";
import type { ActiveMessage, FleetMessage, VehicleDoc } from "../messages";
import { standing } from "../net/api";
import { forgetFlying } from "./flying";
import { forgetGuided } from "./guided";
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

/** Vehicles with which something is wrong that this page does not show and nobody here has seen. */
export const calling = computed(() =>
  fleet.value.filter((each) => each.alarm && isElsewhere(each) && !seen.value.has(keyOf(each))),
);

export const isCallingLoss = computed(() => calling.value.some(({ alarm }) => alarm?.kind === "loss"));

export function acknowledgeElsewhere(): void {
  seen.value = new Set([...seen.value, ...calling.value.map(keyOf)]);
}
