import { number, percent } from "../format";
import type { LandingSiteDoc, TraversabilityState, UwbLiveDoc } from "../messages";
import type { MapLayer } from "./ground_orders";

/** Traversability in a few words. */

export interface LayerWords {
  label: string;
  title: string;
  /** Means something only with a radar log. */
  needsLog: boolean;
}

export const LAYERS: Record<MapLayer, LayerWords> = {
  before: { label: "Before clearing", title: "From slope and roughness alone", needsLog: false },
  cleared: {
    label: "After clearing",
    title: "Without the foliage that the radar saw through",
    needsLog: true,
  },
  probability: { label: "Probability", title: "That a cell holds something hard", needsLog: true },
  time_in_view: { label: "Time in view", title: "How long the radar saw each cell", needsLog: true },
};

export const LAYER_ORDER: readonly MapLayer[] = ["before", "cleared", "probability", "time_in_view"];

/** Without a log there is one map, whatever was chosen. */
export const shownLayer = (chosen: MapLayer, { uwb_log }: Pick<TraversabilityState, "uwb_log">): MapLayer =>
  uwb_log === "" ? "before" : chosen;

const share = (part: number, whole: number) => (whole > 0 ? percent(part / whole, 1) : percent(null));

export interface Figure {
  label: string;
  value: string;
  note: string;
  testid: string;
}

export function figures(state: TraversabilityState): Figure[] {
  const { cells, untraversable, cleared, seen } = state;
  const hasLog = state.uwb_log !== "";
  const withLog = (value: string) => (hasLog ? value : percent(null));
  return [
    { label: "Known", value: number(cells), note: "cells", testid: "cells" },
    {
      label: "Untraversable",
      value: share(untraversable, cells),
      note: `${number(untraversable)} cells`,
      testid: "untraversable",
    },
    {
      label: "Of it cleared",
      value: withLog(share(cleared, untraversable)),
      note: hasLog ? `${number(cleared)} cells` : "needs a radar log",
      testid: "cleared",
    },
    {
      label: "Seen over 2 s",
      value: withLog(share(seen, cells)),
      note: hasLog ? `${number(seen)} cells` : "needs a radar log",
      testid: "seen",
    },
  ];
}

/** What the legend draws: texts and colours that came in equal number, lowest first. */
export function legendOf({ legend, legend_colors }: TraversabilityState): { text: string; color: string }[] {
  return legend.flatMap((text, index) => {
    const color = legend_colors[index];
    return color && /^#[0-9a-f]{6}$/i.test(color) ? [{ text, color }] : [];
  });
}

/** Without the distance, which stands above them; with units as all of the console writes them. */
export const reasonsOf = ({ reasons }: Pick<LandingSiteDoc, "reasons">) =>
  reasons
    .filter((reason) => !reason.endsWith(" from the point"))
    .map((reason) => reason.replace(/(\d) deg\b/g, "$1°").replace(/(\d) (c?m)\b/g, "$1\u00a0$2"));

/** As the 3D view calls it: points of interest have bare numbers. */
export const siteMark = ({ rank }: Pick<LandingSiteDoc, "rank">) => `L${rank}`;

export const siteTitle = (site: LandingSiteDoc) => `Landing site ${siteMark(site)}`;

/** How a radar that scans now does, in one line. */
export function liveWords({ state, source, silent_s, scans, per_s }: UwbLiveDoc): string {
  if (state === "silent") return `${source}: the UWB radar has sent nothing for ${number(silent_s)} s.`;
  return `${source}: ${number(scans)} live scans, ${number(per_s, 1)} a second.`;
}

/** Scans that count for nothing, and why. */
export function leftOut({ unplaced, other_geometry, is_full }: UwbLiveDoc): string[] {
  const notes = [];
  if (unplaced > 0) notes.push(`${number(unplaced)} left out: where the vehicle was is not known.`);
  if (other_geometry > 0) notes.push(`${number(other_geometry)} left out: other range bins than at first.`);
  if (is_full) notes.push("No more are taken: put the maps away to begin anew.");
  return notes;
}
