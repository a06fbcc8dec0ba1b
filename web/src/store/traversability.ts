import { computed, signal } from "@preact/signals";
import type { ErrorDoc, JobDoc, TraversabilityState, UwbLiveDoc } from "../messages";

/** Where the open surface model can be driven on and landed on, as the server last said. */

export const NO_RADAR: UwbLiveDoc = {
  state: "none",
  source: "",
  silent_s: 0,
  scans: 0,
  per_s: 0,
  unplaced: 0,
  other_geometry: 0,
  is_full: false,
  problem: "",
  rule: "",
};

export const NO_GROUND: TraversabilityState = {
  state: "none",
  text: "",
  error: null,
  terrain_id: "",
  resolution_m: 0,
  cells: 0,
  untraversable: 0,
  cleared: 0,
  seen: 0,
  uwb_log: "",
  uwb_rule: "",
  uwb_left_out: "",
  scans: 0,
  legend: [],
  legend_colors: [],
  sites_near: null,
  sites: [],
  no_site: "",
  live: NO_RADAR,
};

export const traversability = signal<TraversabilityState>(NO_GROUND);

export const hasTraversability = computed(() => traversability.value.cells > 0);

/** Working it out, and reading a radar log: how far they are and what went wrong is said in their own section. */
export const isGroundJob = ({ label }: Pick<JobDoc, "label">) => /^Traversability|\.npz$/i.test(label);

/** What the operator has read: the server tells it until the next attempt. */
const read = signal<ErrorDoc | null>(null);

export const groundError = computed(() => {
  const { error } = traversability.value;
  return error && JSON.stringify(error) !== JSON.stringify(read.value) ? error : null;
});

export function dismissGroundError(): void {
  read.value = traversability.value.error;
}

/** The same mistake made again is told again. */
export function tellGroundErrors(): void {
  read.value = null;
}

export function forgetTraversability(): void {
  traversability.value = NO_GROUND;
}
