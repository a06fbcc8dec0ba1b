import { signal } from "@preact/signals";
import type { ComponentType } from "preact";
import { PlanLeft } from "../plan/PlanLeft";
import { PlanRight } from "../plan/PlanRight";

/** A view of the console: what stands left ("what I do") and right ("what is true") of the 3D view. */
export interface View {
  id: string;
  label: string;
  Left: ComponentType;
  Right: ComponentType;
}

/** In the order of their tabs. */
export const views: readonly [View, ...View[]] = [
  { id: "plan", label: "Plan", Left: PlanLeft, Right: PlanRight },
];

export const activeView = signal<View>(views[0]);
