import type { AlertDoc, ObstacleAlert, ObstaclesState } from "../messages";

/** Alerts as they are latched: each stays until it is over and acknowledged. Nothing here reads a clock. */

const MOST_ALERTS = 20;

/** An alert's word comes before the list that holds it: it is shown at once. */
export function withAlert(state: ObstaclesState, alert: ObstacleAlert): ObstaclesState {
  const known = state.alerts.find((entry) => entry.alert.id === alert.id);
  const over = alert.phase === "ends";
  if (!known && over) return state;
  // Its last word says that it is over, not where it was.
  const told = { ...alert, obstacle: alert.obstacle ?? known?.alert.obstacle ?? null };
  const entry: AlertDoc = known
    ? { ...known, alert: told, over }
    : { alert, began_utc_s: alert.t_utc_s, over, acknowledged: false };
  const alerts = known
    ? state.alerts.map((other) => (other === known ? entry : other))
    : [entry, ...state.alerts].slice(0, MOST_ALERTS);
  return { ...state, alerts };
}

export const isShown = (entry: AlertDoc) => !entry.over || !entry.acknowledged;

/** Sounds and shouts: it is there, and nobody has said that they saw it. */
export const isCalling = (entry: AlertDoc) => !entry.over && !entry.acknowledged;

const KINDS: Record<ObstacleAlert["kind"], number> = {
  approach: 0,
  traffic: 0,
  obstacle: 0,
  conflict: 1,
  divergence: 2,
  sensor: 3,
  avoidance: 1,
};

/** Coarsely, so that two obstacles do not change places with every frame, under the hand that acknowledges one. */
function haste(time_to_contact_s: number | null): number {
  if (time_to_contact_s === null) return 3;
  return time_to_contact_s < 3 ? 0 : time_to_contact_s < 10 ? 1 : 2;
}

/** An approach is alerted when it is seconds away. */
const APPROACH_HASTE = 1;
/** Traffic is warned of a minute ahead: what stands in the way of the next seconds goes before it. */
const TRAFFIC_HASTE = 2;

/** Calling before seen before over; then obstacles first, what will be reached soon, and what was there first. */
function rank(entry: AlertDoc): number[] {
  const { obstacle, kind } = entry.alert;
  const stage = isCalling(entry) ? 0 : entry.over ? 2 : 1;
  const soon =
    kind === "approach"
      ? APPROACH_HASTE
      : kind === "traffic"
        ? TRAFFIC_HASTE
        : haste(obstacle?.time_to_contact_s ?? null);
  return [stage, KINDS[kind], soon, entry.began_utc_s];
}

function compare(a: readonly number[], b: readonly number[]): number {
  const at = a.findIndex((value, index) => value !== b[index]);
  return at < 0 ? 0 : (a[at] ?? 0) < (b[at] ?? 0) ? -1 : 1;
}

/** What must be seen, the most urgent first. */
export const inOrder = (alerts: readonly AlertDoc[]): AlertDoc[] =>
  alerts.filter(isShown).sort((a, b) => compare(rank(a), rank(b)));

/** An alert that is over keeps its banner only as long as it takes to read it. */

export const BANNER_MS = 5000;

/** When this page first saw each alert over, by the page's clock. */
export type Endings = ReadonlyMap<string, number>;

export function endingsOf(before: Endings, all: readonly AlertDoc[], now_ms: number): Endings {
  const over = all.filter((entry) => entry.over).map(({ alert }) => alert.id);
  return new Map(over.map((id) => [id, before.get(id) ?? now_ms]));
}

export interface Shown {
  /** With all their figures. */
  banner: AlertDoc[];
  /** Counted on a chip. */
  chip: AlertDoc[];
}

/** What is there stands in the banner, and so does what has just ended, unless something else is there. */
export function parted(all: readonly AlertDoc[], endings: Endings, now_ms: number): Shown {
  const there = all.filter((entry) => !entry.over);
  const isFresh = ({ alert }: AlertDoc) => now_ms - (endings.get(alert.id) ?? now_ms) < BANNER_MS;
  const banner = all.filter((entry) => !entry.over || (there.length === 0 && isFresh(entry)));
  return { banner, chip: all.filter((entry) => !banner.includes(entry)) };
}
