import { isFresh, link, plan, result } from "../store/state";
import { verdictOf, type VerdictKind } from "../store/results";

const WORDS: Record<VerdictKind, string> = {
  none: "No plan yet",
  computing: "Computing…",
  certified: "CERTIFIED",
  not_feasible: "CERTIFIED, NOT FEASIBLE",
  not_certified: "NOT CERTIFIED",
  error: "CANNOT COMPUTE",
};

/** A shape for each verdict, so that it never hangs on colour: shield, octagon, triangle, ring, dash. */
const SHAPES: Record<VerdictKind, { outline: string; mark: string }> = {
  none: { outline: "M12 21a9 9 0 1 1 0-18 9 9 0 0 1 0 18z", mark: "M8 12h8" },
  computing: { outline: "M12 3a9 9 0 1 1-9 9", mark: "" },
  certified: {
    outline: "M12 2.5 20 5.5v6c0 5-3.4 8.3-8 10-4.6-1.7-8-5-8-10v-6z",
    mark: "M8 12l3 3 5-6",
  },
  not_feasible: { outline: "M12 3 22 21H2z", mark: "M12 10v5M12 18v.2" },
  not_certified: { outline: "M8 2.5h8L21.5 8v8L16 21.5H8L2.5 16V8z", mark: "M9 9l6 6M15 9l-6 6" },
  error: { outline: "M12 3 22 21H2z", mark: "M12 10v5M12 18v.2" },
};

export function VerdictShape({ kind, size = 22 }: { kind: VerdictKind; size?: number }) {
  const { outline, mark } = SHAPES[kind];
  return (
    <svg class={`verdict-shape ${kind}`} viewBox="0 0 24 24" width={size} height={size} aria-hidden="true">
      <path class="outline" d={outline} />
      <path class="mark" d={mark} />
    </svg>
  );
}

export const verdict = () => verdictOf(plan.value, isFresh.value);
export function verdictWord(kind: VerdictKind): string {
  if (kind === "computing" && (link.value === "lost" || link.value === "silent")) return "No connection";
  const isNeither = kind === "not_certified" && result.value?.feasible === false;
  return isNeither ? "NOT CERTIFIED, NOT FEASIBLE" : WORDS[kind];
}

/** The certificate in the status bar. */
export function VerdictBadge() {
  const kind = verdict();
  return (
    <span class={`verdict-badge ${kind}`} data-testid="verdict-badge" data-verdict={kind}>
      <VerdictShape kind={kind} size={20} />
      <span>{verdictWord(kind)}</span>
    </span>
  );
}
