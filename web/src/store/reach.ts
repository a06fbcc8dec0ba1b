import { computed } from "@preact/signals";
import { isStale, type Group } from "./ages";
import { now_ms } from "./clock";
import {
  adopted,
  hasLinkFailed,
  heard,
  isLinkDown,
  notInCharge,
  overdue_s,
  SAID_EVERY_S,
  silence_s,
  type Source,
} from "./flying";
import { serverNow_s } from "./server_clock";
import { link } from "./state";

/** How far this page's word reaches, and why no farther. Every control says it with these sentences. */

export type Failed = "server" | "link";

/** What stands between this page and the vehicle and has failed; null: nothing is known to have. */
export const failed = computed<Failed | null>(() => {
  if (link.value !== "open") return "server";
  return hasLinkFailed.value ? "link" : null;
});

const FAILURES = {
  silent: "The server is silent: use the pilot's transmitter",
  server: "No connection: use the pilot's transmitter",
  link: "The link has failed: use the pilot's transmitter",
} as const;

/** Why nothing that is asked here comes to the vehicle, whoever asks it. */
export const whyUnheard = computed(() => {
  if (failed.value === null)
    return isLinkDown.value ? "The vehicle link does not answer and is started again" : null;
  return FAILURES[link.value === "silent" ? "silent" : failed.value];
});

/** Why the server does nothing that only whoever is in charge may ask of it; null: it does. */
export const whyNotAsk = computed(() =>
  failed.value === "server" ? "The server cannot be reached" : notInCharge.value,
);

/** Why the vehicle cannot be commanded from this page; null: it can. */
export const whyNotCommand = computed(() => whyUnheard.value ?? notInCharge.value);

/** Whether a value may no longer be so: it is old, or what would tell that it is has failed. */
export const isOld = (source: Source, group: Group): boolean =>
  (source === "live" && failed.value !== null) || isStale(heard[source].value, group, now_ms.value);

/** What the newest word of the vehicle took from the server to this page. */
function newestTook_s(): number {
  const known = heard.live.value;
  const came_s = known && serverNow_s(known.received_ms);
  return known && came_s !== null ? came_s - known.message.now_mono_s : 0;
}

/** Seconds since what stands here was said, once what would say more has failed; null: nothing was. */
export const unheard_s = computed(() =>
  silence_s.value === null ? null : silence_s.value + Math.max(0, newestTook_s()),
);

/** A line that is slower than what there is to say, from here on. */
const LATE_S = 2;

/**
 * How late words of the vehicle come from the server to this page, whole seconds; null: not noticeably. They come once a
 * second at least: what the newest one took counts, how old it is by now, and for how long the link's has been due.
 */
export const late_s = computed<number | null>(() => {
  if (failed.value !== null) return null;
  const known = heard.live.value;
  const took_s = newestTook_s();
  const since_s = known ? Math.max(0, now_ms.value - known.received_ms) / 1000 : 0;
  const seconds = Math.max(
    took_s,
    adopted.value === null ? 0 : Math.max(took_s + since_s - SAID_EVERY_S, overdue_s.value),
  );
  return seconds < LATE_S ? null : Math.floor(seconds);
});
