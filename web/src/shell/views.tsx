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
  id: ViewId;
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
    sections: ["terrain", "points", "vehicle", "surface", "speeds", "mission", "fence", "traversability"],
  },
  {
    id: "fly",
    label: "Fly",
    Left: FlyLeft,
    Right: FlyRight,
    Below: FlyBelow,
    sections: [
      "connection",
      "onboard",
      "preflight",
      "flight",
      "obstacles",
      "parameters",
      "guided",
      "vehicle-logs",
    ],
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

export const activeView = computed<View>(() => views.find(({ id }) => id === viewId.value) ?? views[0]);
