import type { AlertDoc, ManoeuvreDoc, ObstacleAlert, ObstaclesState } from "../messages";

export type Kind = ManoeuvreDoc["kind"];

export interface Card {
  kind: Kind;
  /** Null while it is being looked for. */
  doc: ManoeuvreDoc | null;
}

/** What is done about each kind of alert; sensors' own troubles have no way past. */
const WAYS: Partial<Record<ObstacleAlert["kind"], readonly Kind[]>> = {
  approach: ["sidestep"],
  obstacle: ["over", "around"],
  conflict: ["over", "around"],
};

/**
 * "Turn 25 deg left, 4.2 m/s" and "for 5 s, passes 3.8 m away": what is flown, and what comes of it; that it then goes
 * back to the mission is always so.
 */
export function sidestepWords(text: string): { does: string; detail: string } {
  const [, does, detail] = /^(.*?\d m\/s),? (.*?)(?:, then .*)?$/.exec(text) ?? [];
  return does && detail ? { does, detail } : { does: text, detail: "" };
}

/** Something to get past, or out of the way of. */
export const hasWays = ({ over, alert }: AlertDoc) => !over && WAYS[alert.kind] !== undefined;

type Known = Pick<ObstaclesState, "manoeuvres" | "busy">;

/** The ways past the first of these alerts that has any: what is still being looked for has its place already. */
function cardsOf(there: readonly AlertDoc[], { manoeuvres, busy }: Known): Card[] {
  const first = there.find((entry) => manoeuvres.some((doc) => doc.for_alert === entry.alert.id));
  const kinds = WAYS[(first ?? there[0])?.alert.kind ?? "sensor"] ?? [];
  if (!first) return busy === "" ? [] : kinds.map((kind) => ({ kind, doc: null }));
  const its = manoeuvres.filter((doc) => doc.for_alert === first.alert.id);
  return kinds.map((kind) => ({ kind, doc: its.find((doc) => doc.kind === kind) ?? null }));
}

/**
 * The ways past the most urgent obstacle and out of the way of the most urgent approach: neither hides the other, and
 * the sidestep stands on top. Null: there is nothing to get past.
 */
export function cardsFor(inOrder: readonly AlertDoc[], known: Known): Card[] | null {
  const there = inOrder.filter(hasWays);
  const approaches = there.filter((entry) => entry.alert.kind === "approach");
  const obstacles = there.filter((entry) => entry.alert.kind !== "approach");
  const cards = [...cardsOf(approaches, known), ...cardsOf(obstacles, known)];
  return cards.length > 0 ? cards : null;
}
