import { batch } from "@preact/signals";
import type { ServerMessage } from "../messages";
import { fly, flight, heard, linkStatus, nodes, recorder, transfer } from "./flying";
import { forgetGuided } from "./guided";
import { forgetHome } from "./home";
import { forgetObstacles, forgetSensing } from "./obstacles";
import { forgetMoving } from "./moving";
import { replay, review } from "./review";
import { forgetStations } from "./stations";
import { forgetFetches, forgetThere } from "./there";
import { forgetTraffic } from "./traffic";
import { forgetTraversability } from "./traversability";

/**
 * After a lost connection the server tells anew what holds. Until then the page keeps what it knew, so that Hold and
 * Return stay where they are; what has not been told again after a while is no longer so.
 */
const GRACE_MS = 3000;

const FORGET: Partial<Record<string, () => void>> = {
  link: () => (linkStatus.value = null),
  transfer: () => (transfer.value = null),
  fly: () => (fly.value = null),
  guided: forgetGuided,
  home: forgetHome,
  nodes: () => (nodes.value = []),
  recorder: () => (recorder.value = null),
  review: () => (review.value = null),
  replay: () => (replay.value = null),
  "flight live": () => (flight.live.value = null),
  "flight replay": () => (flight.replay.value = null),
  "vehicle live": () => (heard.live.value = null),
  "vehicle replay": () => (heard.replay.value = null),
  "perception live": () => forgetSensing("live"),
  "perception replay": () => forgetSensing("replay"),
  "tracks live": () => forgetMoving("live"),
  "tracks replay": () => forgetMoving("replay"),
  "traffic live": () => forgetTraffic("live"),
  "traffic replay": () => forgetTraffic("replay"),
  traversability: forgetTraversability,
  stations: forgetStations,
  station_recordings: forgetThere,
  station_fetches: forgetFetches,
  "obstacles live": () => forgetObstacles("live"),
  "obstacles replay": () => forgetObstacles("replay"),
};

const confirmed = new Set<string>();
let timer: ReturnType<typeof setTimeout> | undefined;

/** Notes that the server has told this since the page was connected. */
export function confirm(message: ServerMessage): void {
  if (timer !== undefined)
    confirmed.add("source" in message ? `${message.type} ${message.source}` : message.type);
}

export function forgetUnconfirmed(): void {
  clearTimeout(timer);
  confirmed.clear();
  timer = setTimeout(() => {
    timer = undefined;
    batch(() => {
      for (const [what, forget] of Object.entries(FORGET)) if (!confirmed.has(what)) forget?.();
    });
  }, GRACE_MS);
}
