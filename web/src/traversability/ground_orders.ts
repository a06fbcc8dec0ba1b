import { effect, signal } from "@preact/signals";
import {
  LIMITS,
  type LandingSitesBody,
  type PlaceDoc,
  type TraversabilityBody,
  type UwbRule,
  type ViewDoc,
} from "../messages";
import { ruleQuery, sendRadarLog } from "../store/files";
import { order } from "../store/outcomes";
import { document_, selection } from "../store/state";
import { setSelection, setView } from "../store/stream";
import { tellGroundErrors } from "../store/traversability";
import { setSection } from "../ui/Section";

/** Everything that is asked of the server about where to drive and land, each with the place of its outcome. */

export const TRAVERSABILITY = "traversability";
export const LANDING = "landing";
export const LIVE_RADAR = "live-radar";

export type MapLayer = ViewDoc["traversability_layer"];

export const layerFile = (layer: MapLayer) => `/api/traversability/map/${layer}.tif`;

/** Of the grid, as it is typed; null: the server chooses. */
export const resolution_m = signal<number | null>(null);

export async function workOut(): Promise<void> {
  tellGroundErrors();
  const body: TraversabilityBody = { resolution_m: resolution_m.value };
  const answer = await order({ place: TRAVERSABILITY, path: "/api/traversability", body });
  if (answer) setView({ show_traversability: true });
}

/** How the next radar log is fused; null: the paper's number. */
export const uwbRule = signal<UwbRule>({ rule: "explained" });

/** The same for a radar that scans now, all its scans so far included. */
export const fuseLive = () =>
  order({
    place: LIVE_RADAR,
    method: "PUT",
    path: `/api/traversability/uwb/live?${new URLSearchParams(ruleQuery(uwbRule.value))}`,
  });

/** A radar log clears the foliage: what it cleared is shown at once. */
export async function clearWith(log: File): Promise<void> {
  tellGroundErrors();
  if (await sendRadarLog(log, uwbRule.value))
    setView({ show_traversability: true, traversability_layer: "cleared" });
}

/** Chosen or dropped: shown where they belong. One map takes one log. */
export function takeRadarLogs(files: readonly File[]): void {
  const [log] = files;
  if (!log) return;
  setSection(TRAVERSABILITY, true);
  void clearWith(log);
}

export const putAway = () =>
  order({ place: TRAVERSABILITY, method: "DELETE", path: "/api/traversability", done: "Put away." });

/** What the operator set for the sites; null: as wide as the plan's vehicle. */
export const rotorSpan_m = signal<number | null>(null);
export const searched_m = signal<number>(LIMITS.LandingSitesBody.radius_m.initial);

const SPAN_M = LIMITS.LandingSitesBody.rotor_span_m;

export function span_m(): number {
  const own_m = 2 * (document_.value?.profile.radius_m ?? 0.4);
  return Math.min(SPAN_M.max, Math.max(SPAN_M.min, rotorSpan_m.value ?? own_m));
}

export async function findSites(near: PlaceDoc): Promise<void> {
  const { lat_deg, lon_deg } = near;
  const body: LandingSitesBody = { lat_deg, lon_deg, rotor_span_m: span_m(), radius_m: searched_m.value };
  const answer = await order({ place: LANDING, path: "/api/traversability/sites", body });
  if (!answer) return;
  setSelection({ site_rank: null });
  setView({ show_traversability: true });
}

/** One of the sites in the 3D view; null: none. */
export function pointOut(site_rank: number | null): void {
  setSelection({ site_rank });
  if (site_rank !== null) setView({ show_traversability: true });
}

/** This page has the tool in hand, so that it, and no other page, asks for the sites where it was clicked. */
const isAiming = signal(false);

export function aim(): void {
  isAiming.value = true;
  setSelection({ tool: "landing", poi_id: null, place: null });
}

effect(() => {
  const { tool, place } = selection.value;
  if (tool === "landing" || !isAiming.peek()) return;
  isAiming.value = false;
  if (place) void findSites(place);
});
