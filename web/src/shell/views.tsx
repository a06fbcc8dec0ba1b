import { computed } from "@preact/signals";
import type { ComponentType } from "preact";
import { ProfilePane } from "../chart/ProfilePane";
import { FlyBelow } from "../fly/FlyBelow";
import { FlyLeft } from "../fly/FlyLeft";
import { FlyRight } from "../fly/FlyRight";
import { PlanLeft } from "../plan/PlanLeft";
import { PlanRight } from "../plan/PlanRight";
import { ReviewLeft } from "../review/ReviewLeft";
import { ReviewRight } from "../review/ReviewRight";
import { StudyCentre } from "../review/Studies";
import { TimePane } from "../review/TimePane";
import type { ViewId } from "../store/address";
import { viewId } from "../store/view";

/** A view of the console: what stands left ("what I do"), right ("what is true") and below the 3D view. */
export interface View {
  id: "plan" | "fly" | "review";
  label: string;
  Left: ComponentType;
  Right: ComponentType;
  Below: ComponentType;
  /** What may lie over the 3D view and what is below it. */
  Over?: ComponentType;
  /** Of the left panel, by their number keys. */
  sections: readonly string[];
}

/** In the order of their tabs. */
export const views: readonly [View, ...View[]] = [
  {
    id: "plan",
    label: "Plan",
    Left: PlanLeft,
    Right: PlanRight,
    Below: ProfilePane,
    sections: ["terrain", "points", "vehicle", "surface", "speeds", "mission", "traversability"],
  },
  {
    id: "fly",
    label: "Fly",
    Left: FlyLeft,
    Right: FlyRight,
    Below: FlyBelow,
    sections: ["connection", "onboard", "preflight", "flight", "obstacles"],
  },
  {
    id: "review",
    label: "Review",
    Left: ReviewLeft,
    Right: ReviewRight,
    Below: TimePane,
    Over: StudyCentre,
    sections: ["recordings", "judge", "maps"],
  },
];

const byId = (id: string) => views.find((view) => view.id === id);
const inAddress = () => byId(location.hash.slice(1).split("/")[0] ?? "");

/** The address tells the view, so that it can be linked and reloaded; without it, the last one of this browser. */
export const activeView = signal<View>(inAddress() ?? byId(lastView.value) ?? views[0]);

export function goTo(id: View["id"]): void {
  const view = byId(id);
  if (!view || view === activeView.value) return;
  activeView.value = view;
  drawer.value = null;
  // What is selected in the plan can be dragged in 3D: not where nobody means to edit.
  const { tool, poi_id } = selection.value;
  if (id !== "plan" && (tool !== "select" || poi_id !== null)) setSelection({ tool: "select", poi_id: null });
}

effect(() => {
  const { id } = activeView.value;
  const address = id === "review" && study.value !== "flights" ? `#review/${study.value}` : `#${id}`;
  lastView.value = id;
  if (location.hash !== address) history.replaceState(null, "", address);
});

window.addEventListener("hashchange", () => {
  const view = inAddress();
  if (view?.id === "review") study.value = studyIn(location.hash) ?? "flights";
  if (view) goTo(view.id);
});
