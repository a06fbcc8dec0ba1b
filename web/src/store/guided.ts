import { signal } from "@preact/signals";
import type { GuidedState } from "../messages";

const NOTHING: GuidedState = { way: null, is_judging: false };

/** The guided way that is judged or flown, as the server last said. */
export const guided = signal<GuidedState>(NOTHING);

export function forgetGuided(): void {
  guided.value = NOTHING;
}
