import { withoutPoi } from "./poi";
import { command, edit } from "./plan";
import { act } from "./outcomes";
import { document_ } from "./state";
import { setSelection } from "./stream";

export const undo = () => command("/api/plan/undo", "plan");
export const redo = () => command("/api/plan/redo", "plan");
export const newPlan = () => command("/api/plan/new", "plans");
export const openPlan = (plan_id: string) => command("/api/plan/open", "plans", { plan_id });
export const savePlanAs = (name: string) => command("/api/plan/save_as", "plans", { name });
export const deletePlan = (id: string) => act("DELETE", `/api/plans/${id}`, "plans");
export const shortestOrder = () => command("/api/plan/shortest_order", "points");
export const useDemo = () => act("POST", "/api/terrains/demo", "terrain");
export const deleteTerrain = (id: string) => act("DELETE", `/api/terrains/${id}`, "terrain");
export const deleteMesh = (id: string) => act("DELETE", `/api/meshes/${id}`, "terrain");
export const removeSpikes = (id: string) => act("POST", `/api/terrains/${id}/remove_spikes`, "terrain");

export function removeSelectedPoi(id: string | null): void {
  const index = document_.value?.pois.findIndex((poi) => poi.id === id) ?? -1;
  if (id === null || index < 0) return;
  edit(`Delete point ${index + 1}`, "points", withoutPoi(id));
  setSelection({ poi_id: null });
}
