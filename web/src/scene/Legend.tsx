import { many, metres, number } from "../format";
import { trackVersion, tracks } from "../store/flying";
import { review } from "../store/review";
import { result, terrain, view } from "../store/state";
import { hasTraversability } from "../store/traversability";

/** Not before the model is drawn, and plain ground has no heights to tell. */
function hasHeights(): boolean {
  const { legend_min_m, legend_max_m } = view.value;
  return legend_min_m !== null && legend_max_m !== null && legend_min_m !== legend_max_m;
}

function HeightScale() {
  const { legend_min_m, legend_max_m } = view.value;
  const datum = terrain.value?.vertical_datum ?? "the model's own datum";
  return (
    <span class="height-scale number" title={`Heights in ${datum}`}>
      {metres(legend_min_m, 0)}
      <span class="gradient" aria-hidden="true" />
      {metres(legend_max_m, 0)}
    </span>
  );
}

function Key({ kind, label, title }: { kind: string; label: string; title?: string }) {
  return (
    <span class="legend-key" title={title}>
      <span class={`swatch ${kind}`} aria-hidden="true" />
      {label}
    </span>
  );
}

/** How many points of the cloud are drawn, or why none is; null: none is asked for. */
function pointsDrawn(): string | null {
  const { show_points, points_shown, points_state, points_of } = view.value;
  if (!show_points || points_shown === 0) return null;
  if (points_state === "loading") return "Points are loading…";
  if (points_state === "failed") return "The points cannot be drawn";
  return points_state === "drawn" ? `${number(points_shown)} of ${many(points_of)} points` : null;
}

/** Whether the textured mesh is drawn; null: it is not asked for, or there is none. */
function meshDrawn(): string | null {
  const { show_textured, textured_triangles, textured_state } = view.value;
  if (!show_textured || textured_triangles === 0) return null;
  if (textured_state === "loading") return "Mesh is loading…";
  if (textured_state === "failed") return "The mesh cannot be drawn";
  return textured_state === "drawn" ? "Mesh: a picture, not certified" : null;
}

/** What the colours of the 3D view mean, in one line along its lower edge: of what is drawn, nothing else. */
export function Legend() {
  const { shading, show_surface, show_path, show_unknown } = view.value;
  const isReview = review.value !== null;
  const planned = result.value !== null && !isReview;
  const flown = !isReview && trackVersion.live.value > 0 && tracks.live.s_m.length > 0;
  const hasUnknown = (terrain.value?.unknown_share ?? 0) > 0;
  const { show_points, show_mesh, show_traversability, points_colored, points_state } = view.value;
  const [points, mesh] = [pointsDrawn(), meshDrawn()];
  const { show_textured, textured_state } = view.value;
  // Colours on the ground keep the model on show.
  const isCovered = show_traversability && hasTraversability.value;
  const asPoints = points_state === "drawn" && show_points;
  const asMesh = textured_state === "drawn" && show_textured;
  const inPlace = (asPoints || asMesh) && !show_mesh && !isCovered;
  const byHeight = hasHeights() && (inPlace ? asPoints && !points_colored : shading === "height");
  const isEmpty =
    !byHeight &&
    !points &&
    !mesh &&
    !(planned && (show_surface || show_path)) &&
    !(show_unknown && hasUnknown) &&
    !flown &&
    !isReview;
  if (isEmpty) return null;
  return (
    <div class="legend overlay" data-testid="legend">
      {byHeight && <HeightScale />}
      {points && (
        <span class="number" data-testid="points-drawn" role="status" title="Thinned evenly for drawing">
          {points_state === "loading" && <span class="spinner" aria-hidden="true" />}
          {points}
        </span>
      )}
      {mesh && (
        <span
          data-testid="mesh-drawn"
          role="status"
          title="Clearance is proved against the surface model alone; nothing is judged by the mesh"
        >
          {textured_state === "loading" && <span class="spinner" aria-hidden="true" />}
          {mesh}
        </span>
      )}
      {planned && show_surface && <Key kind="surface" label="Safe surface" />}
      {planned && show_path && (
        <>
          <Key kind="good" label="Clear" title="Path with the required clearance" />
          <Key kind="near" label="Too near" title="Path with less than the required clearance" />
          <Key kind="bad" label="Inside" title="Path inside or above unknown terrain" />
        </>
      )}
      {flown && <Key kind="flown" label="Flown" title="Where the vehicle has flown" />}
      {isReview && (
        <>
          <Key kind="recorded-plan" label="Plan" title="The plan in the recording" />
          <Key kind="replayed" label="Flown, replay" title="Where the vehicle flew then" />
        </>
      )}
      {show_unknown && hasUnknown && <Key kind="unknown" label="Unknown" title="No height is known there" />}
    </div>
  );
}
