import { effect, signal } from "@preact/signals";
import { document_, pictured, terrain } from "../store/state";

/** The server says that a model is drawn shortly before the browser has it on the screen. */
const ON_ITS_WAY_MS = 600;

const isDrawn = signal(false);
/** The 3D view's page has shown a model since it was opened. */
const hasShown = signal(false);

effect(() => {
  const id = document_.value?.terrain_id ?? null;
  const isPictured = id !== null && pictured.value === id;
  if (!isPictured) {
    isDrawn.value = false;
    return undefined;
  }
  const timer = setTimeout(() => {
    isDrawn.value = true;
    hasShown.value = true;
  }, ON_ITS_WAY_MS);
  return () => clearTimeout(timer);
});

/** Covers the 3D view until its first model is there, and says which one is being drawn. */
export function Loading() {
  if (isDrawn.value || !terrain.value) return null;
  const busy = (
    <p class="scene-busy" role="status" data-testid="scene-busy">
      <span class="spinner" aria-hidden="true" />
      Drawing {terrain.value.name}…
    </p>
  );
  return hasShown.value ? busy : <div class="scene-veil">{busy}</div>;
}
