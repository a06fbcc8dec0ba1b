import { signal } from "@preact/signals";
import type { HomeState } from "../messages";

const NOTHING: HomeState = { asked: null, is_judging: false, ret: null, is_judging_return: false };

/** Home that is to be set, and the vehicle's own return since it was moved, as the server last said. */
export const home = signal<HomeState>(NOTHING);

export function forgetHome(): void {
  home.value = NOTHING;
}
