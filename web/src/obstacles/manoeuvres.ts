import type { AlertDoc, ManoeuvreDoc, ObstaclesState } from "../messages";

export interface Card {
  kind: ManoeuvreDoc["kind"];
  /** Null while it is being looked for. */
  doc: ManoeuvreDoc | null;
}

/** Something to get past: sensors' own troubles are none. */
export const hasWays = ({ over, alert }: AlertDoc) =>
  !over && (alert.kind === "obstacle" || alert.kind === "conflict");

const KINDS = ["over", "around"] as const;

/**
 * The ways past the most urgent obstacle that has any, both of them from the beginning: what is still being looked for
 * has its place already. Null: there is nothing to get past.
 */
export function cardsFor(
  inOrder: readonly AlertDoc[],
  { manoeuvres, busy }: Pick<ObstaclesState, "manoeuvres" | "busy">,
): Card[] | null {
  const there = inOrder.filter(hasWays);
  const first = there.find((entry) => manoeuvres.some((doc) => doc.for_alert === entry.alert.id));
  if (!first) return there.length > 0 && busy !== "" ? KINDS.map((kind) => ({ kind, doc: null })) : null;
  const its = manoeuvres.filter((doc) => doc.for_alert === first.alert.id);
  return KINDS.map((kind) => ({ kind, doc: its.find((doc) => doc.kind === kind) ?? null }));
}
