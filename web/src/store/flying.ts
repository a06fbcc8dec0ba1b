import { computed, signal, type Signal } from "@preact/signals";
import type {
  FlightStatus,
  FlyState,
  HealthRow,
  LeaseDoc,
  LinkStatus,
  MeDoc,
  NodeDoc,
  RecorderStatus,
  ServerMessage,
  TransferStatus,
  VehicleMessage,
} from "../messages";
import type { Heard } from "./ages";
import { now_ms } from "./clock";
import { acknowledge, isLatched, withText, type TextEntry } from "./texts";
import { emptyTrack, extend, trackFrom, type Track } from "./track";

/** The vehicle, the link to it and what may be done with it, as the server last said. */
export type FlyingMessage = Extract<
  ServerMessage,
  {
    type:
      | "vehicle"
      | "track"
      | "text"
      | "link"
      | "transfer"
      | "flight"
      | "fly"
      | "lease"
      | "me"
      | "health"
      | "nodes"
      | "recorder";
  }
>;

/** Where values come from: the vehicle, or a recording. */
export type Source = VehicleMessage["source"];

/** A second more than the link's own limits, for its status comes once a second. */
const STALE_AFTER_S = 2.5;
const LOST_AFTER_S = 4.5;
/** The vehicle's state and the link's, at least, while server and line carry them. */
export const SAID_EVERY_S = 1;

type BySource<T> = Record<Source, Signal<T>>;

export const heard: BySource<Heard | null> = { live: signal(null), replay: signal(null) };
export const tracks: Record<Source, Track> = { live: emptyTrack(), replay: emptyTrack() };
/** Counts up whenever a track has changed. */
export const trackVersion: BySource<number> = { live: signal(0), replay: signal(0) };
export const flight: BySource<FlightStatus | null> = { live: signal(null), replay: signal(null) };
/** How the vehicle is by its own account, row by row; empty: no vehicle. */
export const health: BySource<readonly HealthRow[]> = { live: signal([]), replay: signal([]) };
export const texts = signal<readonly TextEntry[]>([]);
export const linkStatus = signal<{ status: LinkStatus; received_ms: number } | null>(null);
export const transfer = signal<TransferStatus | null>(null);
export const fly = signal<FlyState | null>(null);
export const lease = signal<LeaseDoc>({
  holder: null,
  mine: false,
  silent: false,
  asks: null,
  waits: false,
});
/** Who this page is; unknown until the server has said it. */
export const me = signal<MeDoc | null>(null);
export const isObserver = computed(() => me.value?.role === "observer");
/** Why this page changes nothing; null: it does. */
export const whyObserver = computed(() =>
  isObserver.value ? "You are an observer: you see everything and change nothing" : null,
);
/** Why this page commands nothing; null: it does. */
export const notInCharge = computed(
  () => whyObserver.value ?? (lease.value.mine ? null : "You look on: take control first"),
);
export const nodes = signal<readonly NodeDoc[]>([]);
export const recorder = signal<{ status: RecorderStatus; received_ms: number } | null>(null);

/** The one vehicle that is commanded. */
export const adopted = computed(() => linkStatus.value?.status.adopted ?? null);
/** What the adopted vehicle last said of itself. */
export const vehicle = computed(() => (adopted.value ? (heard.live.value?.message.state ?? null) : null));
export const latched = computed(() => texts.value.filter(isLatched));
export const troubledNodes = computed(() =>
  nodes.value.filter(
    (node) =>
      node.state === "restarting" ||
      node.state === "silent" ||
      (node.state !== "running" && node.text !== ""),
  ),
);

/** Seconds since the vehicle was last heard, growing while the page hears nothing either; null: never heard. */
export const silence_s = computed(() => {
  const known = linkStatus.value;
  if (!known || known.status.silent_s === null) return null;
  return known.status.silent_s + Math.max(0, now_ms.value - known.received_ms) / 1000;
});

/** Seconds by which the link's word is overdue here: it comes once a second while server and line carry it. */
export const overdue_s = computed(() => {
  const known = linkStatus.value;
  return known === null ? 0 : Math.max(0, (now_ms.value - known.received_ms) / 1000 - SAID_EVERY_S);
});

/**
 * Of the vehicle's connection, as the link says. What does not come to this page says nothing of it: that the page is
 * late is another thing (`store/reach.ts`).
 */
export const linkState = computed<LinkStatus["state"]>(() => {
  const state = linkStatus.value?.status.state ?? "none";
  if (state === "none" || silence_s.value === null) return state;
  const silent_s = silence_s.value - overdue_s.value;
  if (silent_s >= LOST_AFTER_S) return "lost";
  return state === "live" && silent_s >= STALE_AFTER_S ? "stale" : state;
});

const isDown = (known: readonly NodeDoc[], name: string) =>
  known.some((node) => node.name === name && (node.state === "silent" || node.state === "restarting"));

/** When the link was last said to be down: what it had told before is not so any more because it runs again. */
const linkDown_ms = signal(-Infinity);

/** The process that commands the vehicle does not answer, is being started again, or has not told anything since. */
export const isLinkDown = computed(() => {
  const told_ms = linkStatus.value?.received_ms;
  return isDown(nodes.value, "link") || (told_ms !== undefined && told_ms <= linkDown_ms.value);
});

/** It is down, and a vehicle was commanded over it. */
export const hasLinkFailed = computed(() => adopted.value !== null && isLinkDown.value);

/** Whether what is happening is still being recorded cannot be told. */
export const isRecorderDown = computed(() => isDown(nodes.value, "recorder"));

/** Length of the running recording; null when nothing is being recorded. */
export const recorded_s = computed(() => {
  const status = recorder.value?.status;
  if (!status?.recording || status.started_utc_s === null) return null;
  return Math.max(0, (performance.timeOrigin + now_ms.value) / 1000 - status.started_utc_s);
});

export const isInAir = computed(() => {
  const state = vehicle.value;
  if (!state?.armed) return false;
  return state.landed === null ? flight.live.value?.phase !== "idle" : state.landed !== "on_ground";
});

export function acknowledgeText(id: number): void {
  texts.value = acknowledge(texts.value, id);
}

/** Words of the vehicles that are not shown, by their numbers: who has read them has not to read them again. */
const kept = new Map<number, readonly TextEntry[]>();

/** Another vehicle is shown: nothing of the one before is taken for its own. */
export function forgetFlying(before: number, now: number): void {
  kept.set(before, texts.value);
  texts.value = kept.get(now) ?? [];
  heard.live.value = flight.live.value = linkStatus.value = null;
  transfer.value = fly.value = recorder.value = null;
  health.live.value = [];
  tracks.live = emptyTrack();
  trackVersion.live.value += 1;
  lease.value = { holder: null, mine: false, silent: false, asks: null, waits: false };
  nodes.value = [];
  linkDown_ms.value = -Infinity;
}

/** Takes one message about the vehicle. */
export function takeFlying(message: FlyingMessage, received_ms: number): void {
  switch (message.type) {
    case "vehicle":
      heard[message.source].value = { message, received_ms };
      if (extend(tracks[message.source], message)) trackVersion[message.source].value += 1;
      return;
    case "track":
      tracks[message.track.source] = trackFrom(message.track);
      trackVersion[message.track.source].value += 1;
      return;
    case "text":
      // A recording's words stand in its list of events.
      if (message.source === "live") texts.value = withText(texts.value, message.text);
      return;
    case "link":
      linkStatus.value = { status: message.link, received_ms };
      return;
    case "transfer":
      transfer.value = message.transfer;
      return;
    case "flight":
      flight[message.source].value = message.flight;
      return;
    case "fly":
      fly.value = message.fly;
      return;
    case "lease":
      lease.value = message.lease;
      return;
    case "me":
      me.value = message.me;
      return;
    case "health":
      health[message.source].value = message.rows;
      return;
    case "nodes":
      nodes.value = message.nodes;
      if (isDown(message.nodes, "link")) linkDown_ms.value = received_ms;
      return;
    case "recorder":
      recorder.value = { status: message.recorder, received_ms };
  }
}
