import { effect, signal } from "@preact/signals";
import { addressOf, studyIn, viewIn, type StudyId, type ViewId } from "./address";
import { lastView } from "./prefs";
import { selection } from "./state";
import { setSelection } from "./stream";

/** What this page looks at, and which passing parts of it are open. */

/** The address tells the view, so that it can be linked and reloaded; without it, the last one of this browser. */
export const viewId = signal<ViewId>(viewIn(location.hash) ?? viewIn(lastView.value) ?? "plan");
export const study = signal<StudyId>(studyIn(location.hash) ?? "flights");

export const openDialog = signal<
  "help" | "plans" | "save_as" | "accounts" | "audit" | "space" | "parameters" | "checklist" | null
>(null);
/** On narrow screens the side panels are drawers: at most one is open. */
export const drawer = signal<"left" | "right" | null>(null);
/** A file is being dragged over the page. */
export const dragging = signal(false);

export function goTo(id: ViewId): void {
  if (id === viewId.value) return;
  viewId.value = id;
  drawer.value = null;
  // What is selected in the plan can be dragged in 3D: not where nobody means to edit.
  const { tool, poi_id, fence_mark } = selection.value;
  if (id !== "plan" && (tool !== "select" || poi_id !== null || fence_mark !== null))
    setSelection({ tool: "select", poi_id: null, fence_mark: null, draft: [] });
}

effect(() => {
  const address = addressOf(viewId.value, study.value);
  lastView.value = viewId.value;
  if (location.hash !== address) history.replaceState(null, "", address);
});

window.addEventListener("hashchange", () => {
  const id = viewIn(location.hash);
  if (id === "review") study.value = studyIn(location.hash) ?? "flights";
  if (id) goTo(id);
});
