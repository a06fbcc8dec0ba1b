import { Button } from "../ui/Button";
import { Changes } from "../ui/Changes";
import type { ViewDoc } from "../messages";
import { result, view } from "../store/state";
import { hasTraversability } from "../store/traversability";
import { follows, frame, setView } from "../store/stream";
import { chase, followed } from "./camera";

type Layer =
  | "show_points"
  | "show_textured"
  | "show_mesh"
  | "show_surface"
  | "show_path"
  | "show_unknown"
  | "show_traversability";

const LAYERS: readonly { layer: Layer; label: string; title: string }[] = [
  { layer: "show_points", label: "Points", title: "The point cloud in place of the model" },
  {
    layer: "show_textured",
    label: "Mesh",
    title: "The textured mesh in place of the model: a picture, nothing is judged by it",
  },
  {
    layer: "show_mesh",
    label: "Model",
    title: "The model beside its points and mesh: it hides what is below it",
  },
  { layer: "show_surface", label: "Surface", title: "The safe surface" },
  { layer: "show_path", label: "Path", title: "The path and the mission as it will be flown" },
  { layer: "show_unknown", label: "Unknown", title: "Where the surface model knows no height" },
  { layer: "show_traversability", label: "Ground", title: "Where one can drive and land" },
];

/** Traversability has to be worked out first, and few models come of a cloud. */
function isThere({ layer }: { layer: Layer }): boolean {
  if (layer === "show_traversability") return hasTraversability.value;
  const [hasPoints, hasTextured] = [view.value.points_shown > 0, view.value.textured_triangles > 0];
  if (layer === "show_points") return hasPoints;
  if (layer === "show_textured") return hasTextured;
  return layer !== "show_mesh" || hasPoints || hasTextured;
}

/** Why the model is drawn whatever is pressed; null: it need not be. */
function boundBy(layer: Layer): string | null {
  if (layer !== "show_mesh") return null;
  const { show_points, points_shown, show_textured, textured_triangles } = view.value;
  if (!(show_points && points_shown > 0) && !(show_textured && textured_triangles > 0))
    return "Without its points or its mesh the model is always drawn";
  return view.value.show_traversability && hasTraversability.value
    ? "The colours of the ground lie on it"
    : null;
}

function toggle(layer: Layer): void {
  const isOn = !view.value[layer];
  const fields: Partial<ViewDoc> = { [layer]: isOn };
  const other = { show_points: "show_textured", show_textured: "show_points" } as const;
  if (layer !== "show_points" && layer !== "show_textured") setView(fields);
  // The model gives way to either, and comes back when neither is drawn.
  else setView({ ...fields, show_mesh: !isOn && !view.value[other[layer]] });
}

/** Layers and camera of the 3D view. */
export function ViewTools() {
  return (
    <div class="view-tools">
      <div class="overlay layers" role="group" aria-label="Layers">
        <Changes>
          {LAYERS.filter(isThere).map(({ layer, label, title }) => (
            <button
              type="button"
              key={layer}
              title={boundBy(layer) ?? title}
              aria-pressed={view.value[layer] || boundBy(layer) !== null}
              disabled={boundBy(layer) !== null}
              data-testid={`layer-${layer.slice("show_".length)}`}
              onClick={() => toggle(layer)}
            >
              <span class="eye" aria-hidden="true" />
              {label}
            </button>
          ))}
        </Changes>
      </div>
      <div class="overlay cameras" role="group" aria-label="Camera">
        {followed.value && (
          <Button
            kind="quiet"
            icon="drone"
            title="Follow the vehicle (V)"
            pressed={follows.value}
            testid="view-vehicle"
            onClick={chase}
          />
        )}
        <Button
          kind="quiet"
          icon="fit"
          title="Fit the plan (F)"
          testid="view-fit"
          onClick={() => frame("plan")}
        />
        <Button
          kind="quiet"
          icon="terrain"
          title="Fit the whole terrain"
          testid="view-terrain"
          onClick={() => frame("terrain")}
        />
        <button
          type="button"
          class="button quiet north"
          title="From above, north up (T)"
          data-testid="view-top"
          onClick={() => frame("top")}
        >
          <svg viewBox="0 0 24 24" width="20" height="20" aria-hidden="true">
            <path class="needle" d="M12 2l4 10h-8z" />
            <path class="tail" d="M12 22l-4-10h8z" />
          </svg>
          <span>N up</span>
        </button>
        {result.value?.worst && (
          <Button
            kind="quiet"
            icon="target"
            title="Show the nearest place"
            testid="view-worst"
            onClick={() => frame("worst")}
          />
        )}
      </div>
    </div>
  );
}
