import { computed, signal } from "@preact/signals";
import type { AlarmDoc } from "../messages";

/** What is wrong with the station itself: each stands until it is over, or until somebody here has read it. */
export const alarms = signal<readonly AlarmDoc[]>([]);

const keyOf = ({ kind, began_utc_s, error }: AlarmDoc) => `${kind} ${began_utc_s} ${error.code}`;
const read = signal<ReadonlySet<string>>(new Set());

/** The worst first. */
export const unreadAlarms = computed(() =>
  alarms.value
    .filter((alarm) => !read.value.has(keyOf(alarm)))
    .sort((a, b) => Number(b.level === "error") - Number(a.level === "error")),
);

/** It goes on standing among the notices. */
export function markRead(alarm: AlarmDoc): void {
  read.value = new Set(read.value).add(keyOf(alarm));
}
