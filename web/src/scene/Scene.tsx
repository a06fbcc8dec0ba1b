import type { ComponentChildren } from "preact";
import { listenInside } from "./frame_events";
import { followed } from "./camera";
import { EmptyState } from "./EmptyState";
import { Legend } from "./Legend";
import { Loading } from "./Loading";
import { MapLegend } from "./MapLegend";
import { ViewTools } from "./ViewTools";
import { AlertBanner } from "../obstacles/AlertBanner";
import { viewId } from "../store/view";
import { review } from "../store/review";
import { document_, pageId, selection, terrain, view } from "../store/state";
import { hasTraversability } from "../store/traversability";
import { MapKey } from "../traversability/MapKey";

const HINTS = {
  select: null,
  add_poi: "Click the surface to add a point",
  polygon: "Click the surface to add a corner",
  home: "Click the surface to put home there",
  look_at: "Click the surface where the nose shall point",
  landing: "Click the surface near which to land",
} as const;

/** viser's handle for moving in the plane is a blue square beside its point: nobody would guess. */
function MoveHint({ id }: { id: string }) {
  const index = document_.value?.pois.findIndex((poi) => poi.id === id) ?? -1;
  if (index < 0) return null;
  return (
    <p class="tool-hint" data-testid="move-hint">
      <span class="handle-swatch" aria-hidden="true" /> Drag the blue square to move point {index + 1}
    </p>
  );
}

function ToolHint() {
  const { tool, poi_id } = selection.value;
  const hint = HINTS[tool];
  if (!terrain.value) return null;
  if (tool === "select" && poi_id !== null && document_.value?.source === "pois")
    return <MoveHint id={poi_id} />;
  if (!hint) return null;
  return (
    <p class="tool-hint" data-testid="tool-hint">
      {hint} <span>·</span> <kbd>Esc</kbd> to stop
    </p>
  );
}

interface SceneProps {
  /** Keys that are pressed in the 3D view, which is a page of its own. */
  onKey: (event: KeyboardEvent) => void;
  /** Messages, below the alerts. */
  children: ComponentChildren;
}

/** The 3D view with what lies on it. */
export function Scene({ onKey, children }: SceneProps) {
  const id = pageId.value;
  // Without a surface model a recording, and a vehicle that flies, stand on plain ground of their own.
  const isFlown = review.value !== null || (viewId.value === "fly" && followed.value !== null);
  const hasTerrain = terrain.value !== null || isFlown;
  return (
    <section class={`scene tool-${selection.value.tool}`} aria-label="3D view" data-testid="scene">
      {id && (
        <iframe
          src={`/view/${encodeURIComponent(id)}/`}
          title="3D view of terrain, safe surface and path"
          data-testid="view-frame"
          onLoad={(event) => listenInside(event.currentTarget, onKey)}
        />
      )}
      <Loading />
      {document_.value && !hasTerrain && <EmptyState />}
      {hasTerrain && <ViewTools />}
      <div class="scene-foot">
        <ToolHint />
        {hasTerrain && (
          <>
            {hasTraversability.value && view.value.show_traversability && <MapKey isOverlay />}
            <MapLegend />
            <Legend />
          </>
        )}
      </div>
      <div class="scene-messages">
        <AlertBanner />
        {children}
      </div>
    </section>
  );
}
