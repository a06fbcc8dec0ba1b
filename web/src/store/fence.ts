import type { DetourDoc, FenceDoc, PlanDoc, RallyDoc } from "../messages";
import { edit } from "./plan";
import { document_, selection } from "./state";
import { setSelection } from "./stream";

/** A shape or a rally point by its id; a polygon's corner with its number, from 0, after a dot. */
export const markOf = (id: string, corner?: number) => (corner === undefined ? id : `${id}.${corner}`);
export const shapeIdOf = (mark: string | null) => mark?.split(".")[0] ?? null;
const cornerOf = (mark: string) => (mark.includes(".") ? Number(mark.split(".")[1]) : null);

export const editFence = (label: string, change: (fence: FenceDoc) => Partial<FenceDoc>) =>
  edit(label, "fence", (doc) => ({ ...doc, fence: { ...doc.fence, ...change(doc.fence) } }));

type Shape = "polygons" | "circles";

/** Changes one polygon or circle, wherever it is by then. */
export const editShape = <K extends Shape>(
  kind: K,
  id: string,
  label: string,
  fields: Partial<FenceDoc[K][number]>,
) =>
  editFence(label, (fence) => ({
    [kind]: fence[kind].map((each) => (each.id === id ? { ...each, ...fields } : each)),
  }));

export const editRally = (id: string, label: string, fields: Partial<RallyDoc>) =>
  edit(label, "fence", (doc) => ({
    ...doc,
    rally: doc.rally.map((each) => (each.id === id ? { ...each, ...fields } : each)),
  }));

/** The plan without what a mark stands for: a corner of a polygon that keeps three, else the whole. */
export function withoutMark(plan: PlanDoc, mark: string): PlanDoc {
  const [id, corner] = [shapeIdOf(mark), cornerOf(mark)];
  const polygons = plan.fence.polygons.flatMap((each) => {
    if (each.id !== id) return [each];
    if (corner === null || each.corners.length <= 3) return [];
    return [{ ...each, corners: each.corners.filter((_, at) => at !== corner) }];
  });
  const circles = plan.fence.circles.filter((each) => each.id !== id);
  const rally = plan.rally.filter((each) => each.id !== id);
  return { ...plan, fence: { ...plan.fence, polygons, circles }, rally };
}

/** What a mark is called; null when there is none. */
export function markTitle(plan: PlanDoc, mark: string): string | null {
  const [id, corner] = [shapeIdOf(mark), cornerOf(mark)];
  const numbers = [
    ["polygon", plan.fence.polygons.findIndex((each) => each.id === id)],
    ["circle", plan.fence.circles.findIndex((each) => each.id === id)],
    ["rally point", plan.rally.findIndex((each) => each.id === id)],
  ] as const;
  const found = numbers.find(([, index]) => index >= 0);
  if (!found) return null;
  const name = `${found[0]} ${found[1] + 1}`;
  return corner === null ? name : `corner ${corner + 1} of ${name}`;
}

export function removeMark(mark: string | null): void {
  const title = mark && document_.value ? markTitle(document_.value, mark) : null;
  if (mark === null || title === null) return;
  edit(`Delete ${title}`, "fence", (doc) => withoutMark(doc, mark));
  if (shapeIdOf(selection.value.fence_mark) === shapeIdOf(mark)) setSelection({ fence_mark: null });
}

export const selectMark = (mark: string | null) =>
  setSelection({ tool: "select", fence_mark: mark, poi_id: null, draft: [] });

/** The shapes that the path is laid around on the way to a point, each once. */
export function aroundTo(detours: readonly DetourDoc[], index: number): string[] {
  return [...new Set(detours.filter((each) => each.before_poi === index).map((each) => each.shape))];
}
