import { effect, signal } from "@preact/signals";
import type { TerrainDoc } from "../messages";
import { sentFileOf, sentFiles } from "./files";
import { edit } from "./plan";
import { document_, jobs, library, notify } from "./state";
import { drawer } from "./view";

/** A surface model that this page sent and the open plan has not taken. */
export const offered = signal<string | null>(null);

export function useTerrain(entry: TerrainDoc): void {
  edit(`Use ${entry.name}`, "terrain", (doc) => ({
    ...doc,
    terrain_id: entry.id,
    orthophoto_id: null,
    seen_id: null,
    seen_lacks: "",
  }));
  offered.value = null;
}

let seen: ReadonlySet<string> | null = null;

/** The models of a library that were not there before; the first library has none. */
export function arrivalsOf(
  terrains: readonly TerrainDoc[],
  before: ReadonlySet<string> | null,
): TerrainDoc[] {
  return before === null ? [] : terrains.filter((entry) => !before.has(entry.id));
}

effect(() => {
  const { terrains } = library.value;
  if (document_.peek() === null) return;
  for (const entry of arrivalsOf(terrains, seen)) {
    const sent = sentFileOf(entry.name);
    // A plan without points takes the model by itself, on the server.
    if (sent?.replaces && !entry.in_doubt && document_.peek()?.pois.length) useTerrain(entry);
    else if (sent) offered.value = entry.id;
  }
  seen = new Set(terrains.map((entry) => entry.id));
});

/** As in layout.css: so narrow, panels are drawers, and what failed would stand in one that is closed. */
const NARROW = "(max-width: 1099px)";
const told = new Set<string>();

effect(() => {
  for (const { id, state, error } of jobs.value.values()) {
    if (state !== "failed" || !error || told.has(id) || !sentFiles.peek().has(id)) continue;
    told.add(id);
    const isTucked = typeof matchMedia === "function" && matchMedia(NARROW).matches;
    if (isTucked && drawer.peek() !== "left") notify("error", error);
  }
});
