import { metres, number } from "../format";
import { Icon } from "../ui/Icon";
import { terrain, view } from "../store/state";

function HeightScale() {
  const { legend_min_m, legend_max_m } = view.value;
  if (legend_min_m === null || legend_max_m === null) return null;
  const datum = terrain.value?.vertical_datum ?? "the model's own datum";
  const middle_m = (legend_min_m + legend_max_m) / 2;
  return (
    <div class="height-scale" title={`Heights in ${datum}`}>
      <span class="gradient" aria-hidden="true" />
      <span class="ticks number">
        <span>{metres(legend_max_m, 0)}</span>
        <span>{number(middle_m)}</span>
        <span>{number(legend_min_m)}</span>
      </span>
    </div>
  );
}

function Key({ kind, label }: { kind: string; label: string }) {
  return (
    <span class="legend-key">
      <span class={`swatch ${kind}`} aria-hidden="true" />
      {label}
    </span>
  );
}

/** What the colours of the 3D view mean. */
export function Legend() {
  const { shading, show_surface, show_path, show_unknown } = view.value;
  const model = terrain.value;
  return (
    <div class="legend overlay" data-testid="legend">
      {shading === "height" && <HeightScale />}
      <div class="legend-keys">
        {show_surface && <Key kind="surface" label="Safe surface" />}
        {show_path && (
          <>
            <Key kind="good" label="Path, clear" />
            <Key kind="near" label="Too near" />
            <Key kind="bad" label="Inside" />
          </>
        )}
        {show_unknown && (model?.unknown_share ?? 0) > 0 && <Key kind="unknown" label="Unknown" />}
        {model && (
          <span class="legend-key muted">
            <Icon name="fit" size={14} />
            {number(model.width_px * model.resolution_m)} × {metres(model.height_px * model.resolution_m, 0)}
          </span>
        )}
      </div>
    </div>
  );
}
