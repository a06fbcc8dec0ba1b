import type { AlertDoc } from "../messages";

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
