import { effect, signal } from "@preact/signals";
import type { PlaceDoc } from "../messages";
import { selection } from "../store/state";
import { setSelection } from "../store/stream";
import { drawer } from "../store/view";

/** One click on the surface, for whoever on this page has asked for it: no other page acts on it. */

export type AimsFor = "way" | "home";

interface Aim {
  what: AimsFor;
  then: (place: PlaceDoc) => void;
  /** The drawer in which it was asked for: what comes of it appears there. */
  from: typeof drawer.value;
}

const aiming = signal<Aim | null>(null);

export const aimsFor = (): AimsFor | null => aiming.value?.what ?? null;

/** Asked for again it is put away. */
export function aim(what: AimsFor, then: (place: PlaceDoc) => void): void {
  if (selection.value.tool === "there") {
    const isSame = aimsFor() === what;
    setSelection({ tool: "select" });
    if (isSame) return;
  }
  aiming.value = { what, then, from: drawer.value };
  setSelection({ tool: "there", poi_id: null, fence_mark: null, place: null });
  // On narrow screens the drawer would cover what is to be clicked.
  drawer.value = null;
}

effect(() => {
  const { tool, place } = selection.value;
  const asked = aiming.peek();
  if (tool === "there" || !asked) return;
  aiming.value = null;
  if (!place) return;
  drawer.value = asked.from;
  asked.then(place);
});
