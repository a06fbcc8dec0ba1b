import type { Computation, PlanDoc, PlanState, PoiDoc, ResultDoc } from "../src/messages";

/** Small plans for the tests. */

export function poi(id: string, fields: Partial<PoiDoc> = {}): PoiDoc {
  return { id, lat_deg: 46, lon_deg: 7, name: "", loiter_s: 0, ...fields };
}

export function plan(fields: Partial<PlanDoc> = {}): PlanDoc {
  return {
    name: "Test",
    terrain_id: "t1",
    orthophoto_id: null,
    source: "pois",
    pois: [poi("a"), poi("b"), poi("c")],
    surface: { radius_m: 20, height_m: 5, smooth_sigma_m: null, floor: true },
    ...fields,
  } as PlanDoc;
}

export function computation(fields: Partial<Computation> = {}): Computation {
  return { revision: 1, state: "running", hint: "", error: null, result: null, ...fields };
}

export function state(revision: number, fields: Partial<PlanState> = {}): PlanState {
  return {
    plan_id: "p1",
    revision,
    document: plan(),
    can_undo: false,
    can_redo: false,
    undo_label: "",
    redo_label: "",
    saved_utc: "2026-01-01T00:00:00Z",
    computation: computation({ revision }),
    ...fields,
  };
}

export const result = (certified: boolean, feasible: boolean | null = true) =>
  ({ certified, feasible }) as ResultDoc;
