import { signal, type ReadonlySignal } from "@preact/signals";

/** Whether the window is as a media query says, told whenever that changes. */
export function matching(query: string): ReadonlySignal<boolean> {
  const list = typeof matchMedia === "function" ? matchMedia(query) : null;
  const isSo = signal(list?.matches ?? false);
  list?.addEventListener("change", (event) => (isSo.value = event.matches));
  return isSo;
}
