import { computed, signal } from "@preact/signals";
import { age, bytes, duration, number } from "../format";
import type { RecordingFetchDoc, RecordingsThereDoc, StationRecordingsDoc } from "../messages";
import { asErrorDoc, isCancelled, requestJson } from "../net/api";
import { now_ms } from "./clock";
import { order } from "./outcomes";
import { setError } from "./state";

/** Recordings of other stations, by station; null where none are met. */
export const there = signal<StationRecordingsDoc[] | null>(null);
/** What is fetched of them. */
export const fetches = signal<RecordingFetchDoc[]>([]);
/** Where errors of them appear. */
export const THERE = "stations-recordings";

let received_ms = 0;

export function takeLists(stations: StationRecordingsDoc[], at_ms: number): void {
  received_ms = at_ms;
  there.value = stations;
}

export function takeThere(doc: RecordingsThereDoc, at_ms: number): void {
  takeLists(doc.stations, at_ms);
  fetches.value = doc.fetches;
}

export const forgetThere = () => {
  there.value = null;
};

export const forgetFetches = () => {
  fetches.value = [];
};

const pathOf = (station: string, sha256: string) =>
  `/api/stations/${encodeURIComponent(station)}/recordings/${sha256}`;

/** Has the stations that are heard asked for their lists; those that are fresh are left: 30 s, after a press 3. */
export async function askThere({ pressed = false } = {}): Promise<void> {
  try {
    takeThere(
      await requestJson<RecordingsThereDoc>(
        "GET",
        `/api/stations/recordings?ask=true${pressed ? "&fresh_s=3" : ""}`,
      ),
      performance.now(),
    );
    setError(THERE, null);
  } catch (error) {
    if (!isCancelled(error)) setError(THERE, asErrorDoc(error));
  }
}

export const fetchThere = (station: string, sha256: string) =>
  order({ place: THERE, path: pathOf(station, sha256) });

export const endFetch = ({ station, sha256 }: RecordingFetchDoc) =>
  order({ place: THERE, path: pathOf(station, sha256), method: "DELETE" });

/** Two stations may offer the same bytes. */
const keyOf = (station: string, sha256: string) => `${station} ${sha256}`;

export const fetchOf = (station: string, sha256: string): RecordingFetchDoc | undefined =>
  fetches.value.find((fetch) => fetch.station === station && fetch.sha256 === sha256);

/** Fetches that stand in no list: their station is not listed anew since, or lists them no more. */
export const unlisted = computed(() => {
  const listed = new Set(
    there.value?.flatMap(({ name, recordings }) => recordings.map(({ sha256 }) => keyOf(name, sha256))),
  );
  return fetches.value.filter(({ station, sha256 }) => !listed.has(keyOf(station, sha256)));
});

/** How a station's list stands: lost first, then how old what is shown is. */
export function listWords({ state, listed, age_s }: StationRecordingsDoc): string {
  const by_now = age_s === null ? "" : age(1000 * age_s + Math.max(0, now_ms.value - received_ms));
  const old = by_now === "now" ? "just now" : by_now && `${by_now} ago`;
  const how = { no: "not asked yet", asking: "being asked…", listed: "", silent: "no answer", off: "" }[
    listed
  ];
  return [state === "lost" ? "lost" : "", state === "lost" && listed === "asking" ? "" : how, old]
    .filter(Boolean)
    .join(" · ");
}

/** What a fetch has come to; why it waits or failed stands beside it. */
export function fetchWords({ state, have_bytes, bytes: all, left_s }: RecordingFetchDoc): string {
  const part = `${number(have_bytes / 1e6, 1)} of ${bytes(all)}`;
  switch (state) {
    case "waiting":
      return `waits · ${part}`;
    case "fetching":
      return left_s === null ? part : `${part} · ${duration(left_s)} left`;
    case "checking":
      return "checking its SHA-256…";
    case "whole":
      return "opening…";
    case "failed":
      return have_bytes ? `failed at ${part}` : "failed";
  }
}
