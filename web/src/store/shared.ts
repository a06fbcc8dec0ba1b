import { batch } from "@preact/signals";
import type { SelectionDoc, ViewDoc } from "../messages";
import * as state from "./state";

/**
 * What all pages show together. A page's own change shows at once; what the server says before it has answered that
 * change may be older, and waits.
 */
let asked = 0;
let answered = 0;
const waiting = new Map<string, () => void>();

/** The number of the change that this page asks for now. */
export const nextChange = () => ++asked;

/** All changes up to this one are carried out, and the state after them has come before. */
export function takeAnswer(change: number): void {
  answered = Math.max(answered, change);
  settle();
}

export function takeView(view: ViewDoc): void {
  waiting.set("view", () => {
    state.view.value = view;
    // The server tells the legend's ends when it has drawn a terrain.
    const terrainId = state.document_.value?.terrain_id ?? null;
    state.pictured.value = view.legend_min_m === null ? null : terrainId;
  });
  settle();
}

export function takeSelection(selection: SelectionDoc): void {
  waiting.set("selection", () => (state.selection.value = selection));
  settle();
}

/** A new connection: changes that the old one did not carry are lost, and nothing is waited for. */
export function forgetAsked(): void {
  answered = asked;
  waiting.clear();
}

function settle(): void {
  if (answered < asked) return;
  batch(() => waiting.forEach((show) => show()));
  waiting.clear();
}
