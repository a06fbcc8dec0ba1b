import type { TraversabilityState } from "../messages";
import { view } from "../store/state";
import { setView } from "../store/stream";
import { Icon } from "../ui/Icon";
import { Check } from "../ui/fields";
import { MapKey } from "./MapKey";
import { layerFile } from "./ground_orders";
import { LAYERS, LAYER_ORDER, figures, shownLayer } from "./ground_words";

/** The finished maps: on the ground in 3D, as figures, as files. */

export function Layers({ state }: { state: TraversabilityState }) {
  const shown = shownLayer(view.value.traversability_layer, state);
  const hasLog = state.uwb_log !== "";
  return (
    <>
      <Check
        label="Show it on the ground in 3D"
        checked={view.value.show_traversability}
        testid="show-traversability"
        onChange={(show_traversability) => setView({ show_traversability })}
      />
      <div class="segmented map-layers" role="group" aria-label="Layer" data-testid="map-layers">
        {LAYER_ORDER.map((layer) => {
          const { label, title, needsLog } = LAYERS[layer];
          const isMissing = needsLog && !hasLog;
          return (
            <button
              type="button"
              key={layer}
              title={isMissing ? "Open a radar log first" : title}
              disabled={isMissing}
              aria-pressed={layer === shown}
              data-testid={`map-layer-${layer}`}
              onClick={() => setView({ traversability_layer: layer, show_traversability: true })}
            >
              {label}
            </button>
          );
        })}
      </div>
      <MapKey />
    </>
  );
}

export function Figures({ state }: { state: TraversabilityState }) {
  return (
    <dl class="ground-figures">
      {figures(state).map(({ label, value, note, testid }) => (
        <div key={label}>
          <dt>{label}</dt>
          <dd data-testid={`ground-${testid}`}>
            <strong>{value}</strong> <span class="muted">{note}</span>
          </dd>
        </div>
      ))}
    </dl>
  );
}

export function Files({ state }: { state: TraversabilityState }) {
  const there = LAYER_ORDER.filter((layer) => !LAYERS[layer].needsLog || state.uwb_log !== "");
  return (
    <>
      <h3>Maps as GeoTIFF</h3>
      <div class="map-files ground-files">
        {there.map((layer) => (
          <a
            key={layer}
            class="button"
            href={layerFile(layer)}
            download
            title={`${LAYERS[layer].title}, as GeoTIFF`}
            data-testid={`ground-${layer}-tif`}
          >
            <Icon name="export" size={16} /> {LAYERS[layer].label}
          </a>
        ))}
      </div>
    </>
  );
}
