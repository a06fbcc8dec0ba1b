import { computed, signal } from "@preact/signals";
import type {
  CursorMessage,
  ErrorDoc,
  JobDoc,
  LibraryState,
  PlanDoc,
  PlanState,
  SelectionDoc,
  TerrainDoc,
  ViewDoc,
} from "../messages";
import type { LinkState } from "../net/socket";
import { rememberResult, type KnownResult } from "./results";

export interface Notice {
  id: number;
  level: "info" | "warning" | "error";
  error: ErrorDoc;
  at_ms: number;
}

/** What the server last said about the plan, and the document as this page shows it. */
export const plan = signal<PlanState | null>(null);
export const document_ = signal<PlanDoc | null>(null);
export const saving = signal(false);
export const library = signal<LibraryState>({
  terrains: [],
  orthophotos: [],
  meshes: [],
  plans: [],
  profiles: [],
});
export const view = signal<ViewDoc>({
  shading: "height",
  show_points: false,
  show_textured: false,
  show_mesh: true,
  show_surface: true,
  show_path: true,
  show_unknown: true,
  show_radar_map: true,
  show_vision_map: true,
  show_vision_flight: false,
  show_cloud: false,
  show_explained: false,
  show_regions: true,
  show_tracks: true,
  show_traffic: true,
  show_traversability: false,
  traversability_layer: "cleared",
  vertical_exaggeration: 1,
  legend_min_m: null,
  legend_max_m: null,
  points_shown: 0,
  points_state: "none",
  textured_triangles: 0,
  textured_state: "none",
  points_of: 0,
  points_colored: false,
});
/** The terrain that the 3D view shows; null until the server says so. */
export const pictured = signal<string | null>(null);
export const NOTHING_SELECTED: SelectionDoc = {
  tool: "select",
  poi_id: null,
  fence_mark: null,
  draft: [],
  place: null,
  site_rank: null,
};
export const selection = signal(NOTHING_SELECTED);
export const jobs = signal<ReadonlyMap<string, JobDoc>>(new Map());
export const cursor = signal<CursorMessage | null>(null);
export const link = signal<LinkState>("connecting");
export const pageId = signal<string | null>(null);
export const productVersion = signal("");
export const notices = signal<Notice[]>([]);
/** Errors by the part of the page where they happened. */
export const errors = signal<Readonly<Record<string, ErrorDoc>>>({});
/** The part of the page that changed the plan last: an error of the computation is shown there as well. */
export const editedPlace = signal("");
export const known = signal<KnownResult | null>(null);

export const computation = computed(() => plan.value?.computation ?? null);
export const result = computed(() => known.value?.result ?? null);
/** Whether the figures on the page belong to the document on the page. */
export const isFresh = computed(() => {
  const now = computation.value;
  return now?.state === "ready" && now.revision === plan.value?.revision && !saving.value;
});
export const terrain = computed<TerrainDoc | null>(() => {
  const id = document_.value?.terrain_id;
  return library.value.terrains.find((entry) => entry.id === id) ?? null;
});
export const runningJobs = computed(() => [...jobs.value.values()].filter((job) => job.state === "running"));

export function setPlan(state: PlanState | null, shown: PlanDoc | null, dirty: boolean): void {
  plan.value = state;
  document_.value = shown;
  saving.value = dirty;
  if (state) known.value = rememberResult(known.value, state, Date.now());
}

export function setError(place: string, error: ErrorDoc | null): void {
  const { [place]: _, ...others } = errors.value;
  errors.value = error ? { ...others, [place]: error } : others;
}

let nextNotice = 1;
const MOST_NOTICES = 100;

export function notify(level: Notice["level"], error: ErrorDoc): void {
  const notice = { id: nextNotice++, level, error, at_ms: Date.now() };
  notices.value = [notice, ...notices.value].slice(0, MOST_NOTICES);
}

export function notifyText(level: Notice["level"], what: string, advice = ""): void {
  notify(level, { code: "page", what, where: "", advice });
}
