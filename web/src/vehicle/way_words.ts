import type { WayStatus } from "../messages";
import { DASH, number, percent, withUnit } from "../format";

/** One of several ways to the vehicle in figures. */

/** Of radios: 255 says that it is not known. */
const NOT_TOLD = 255;
const LIVE_S = 1.5;

/** `told_s`: how long ago the link said so. */
export const ageWord = (way: WayStatus, told_s: number) =>
  way.silent_s === null ? DASH : withUnit(way.silent_s + told_s, "s", 1);

export const lossWord = (way: WayStatus) => (way.quality === null ? DASH : percent(1 - way.quality));

export const roundTripWord = (way: WayStatus) =>
  way.round_trip_s === null ? DASH : withUnit(Math.round(way.round_trip_s * 1000), "ms");

const level = (value: number) => (value === NOT_TOLD ? DASH : number(value));

/** Here, and as the vehicle's radio receives: either end loses packets. */
export const signalWord = (way: WayStatus) =>
  way.signal === null ? DASH : `${level(way.signal.rssi)} / ${level(way.signal.remote_rssi)}`;

export const signalTitle = (way: WayStatus) =>
  way.signal === null
    ? "No radio tells of its signal here"
    : `Here ${level(way.signal.rssi)} over noise ${level(way.signal.noise)}, at the vehicle ` +
      `${level(way.signal.remote_rssi)} over noise ${level(way.signal.remote_noise)}, in the radio's units`;

/** Another way is heard now: this one may be taken away in flight. */
export const hasAnotherWay = (ways: readonly WayStatus[], address: string) =>
  ways.some((way) => way.address === address) && ways.some((way) => way.address !== address && isLive(way));

const isLive = (way: WayStatus) => way.identity === "known" && way.silent_s !== null && way.silent_s < LIVE_S;

/** "over tcp:10.0.0.7:5760" where there are several; empty else. */
export function wayInUse(ways: readonly WayStatus[]): string {
  const used = ways.find((way) => way.in_use);
  return ways.length > 1 && used ? `over ${used.address}` : "";
}
