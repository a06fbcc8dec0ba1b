import { traversability } from "../store/traversability";
import { legendOf } from "./ground_words";

/** What the colours of the layer on show mean, lowest first. */
export function MapKey({ isOverlay = false }: { isOverlay?: boolean }) {
  const entries = legendOf(traversability.value);
  if (entries.length === 0) return null;
  return (
    <ul class={`map-key ${isOverlay ? "overlay" : ""}`} aria-label="Colours of the layer">
      {entries.map(({ text, color }) => (
        <li key={text}>
          <span class="swatch ground-swatch" style={{ background: color }} aria-hidden="true" />
          {text}
        </li>
      ))}
    </ul>
  );
}
