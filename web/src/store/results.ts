import type { PlanState, ResultDoc } from "../messages";

/** The last result that was computed, shown greyed while a newer one is on its way. */
export interface KnownResult {
  planId: string;
  revision: number;
  at_ms: number;
  result: ResultDoc;
}

/** Keeps a plan's old figures while new ones are computed; an empty plan or another one forgets them. */
export function rememberResult(
  before: KnownResult | null,
  state: PlanState,
  now_ms: number,
): KnownResult | null {
  const { result, revision, state: stage } = state.computation;
  if (result) {
    const same =
      before?.result === result || (before?.planId === state.plan_id && before.revision === revision);
    return { planId: state.plan_id, revision, at_ms: same && before ? before.at_ms : now_ms, result };
  }
  const isSamePlan = before?.planId === state.plan_id;
  return stage === "running" && isSamePlan ? before : null;
}

export type VerdictKind = "none" | "computing" | "certified" | "not_feasible" | "not_certified" | "error";

/** Clearance and feasibility in one. Figures of an older document never count as a verdict. */
export function verdictOf(state: PlanState | null, fresh: boolean): VerdictKind {
  const stage = state?.computation.state ?? "empty";
  if (stage === "empty") return "none";
  if (stage === "error") return "error";
  const result = state?.computation.result;
  if (stage === "running" || !fresh || !result) return "computing";
  if (!result.certified) return "not_certified";
  return result.feasible === false ? "not_feasible" : "certified";
}
