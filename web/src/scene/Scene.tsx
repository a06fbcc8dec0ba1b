import type { ComponentChildren } from "preact";
import { listenInside } from "./frame_events";
import { followed } from "./camera";
import { EmptyState } from "./EmptyState";
import { Legend } from "./Legend";
import { Loading } from "./Loading";
import { MapLegend } from "./MapLegend";
import { ViewTools } from "./ViewTools";
import { AlertBanner } from "../obstacles/AlertBanner";
import { markTitle } from "../store/fence";
import { viewId } from "../store/view";
import { aimsFor } from "../vehicle/aiming";
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
  there: "Click the surface: the way leads there",
  fence_polygon: "Click the surface to add a corner of the fence",
  fence_circle: "Click the surface to put a circle's centre",
  rally: "Click the surface to put a rally point",
} as const;

/** viser's handle for moving in the plane is a blue square beside its point: nobody would guess. */
function MoveHint({ title }: { title: string }) {
  return (
    <p class="tool-hint" data-testid="move-hint">
      <span class="handle-swatch" aria-hidden="true" /> Drag the blue square to move {title}
    </p>
  );
}

/** What of the plan has handles; null: nothing. */
function chosenTitle(): string | null {
  const { poi_id, fence_mark } = selection.value;
  const plan = document_.value;
  if (!plan) return null;
  if (fence_mark !== null) return markTitle(plan, fence_mark);
  const index = plan.source === "pois" ? plan.pois.findIndex((poi) => poi.id === poi_id) : -1;
  return index < 0 ? null : `point ${index + 1}`;
}

function ToolHint() {
  const { tool, draft } = selection.value;
  const hint = tool === "there" && aimsFor() === "home" ? HINTS.home : HINTS[tool];
  if (!terrain.value) return null;
  const chosen = tool === "select" ? chosenTitle() : null;
  if (chosen) return <MoveHint title={chosen} />;
  if (!hint) return null;
  const missing =
    tool === "fence_polygon" && draft.length > 0 ? `: ${3 - draft.length} more make it one` : "";
  return (
    <p class="tool-hint" data-testid="tool-hint">
      {hint}
      {missing} <span>·</span> <kbd>Esc</kbd> to stop
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
