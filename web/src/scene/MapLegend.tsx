import { metres, number } from "../format";
import type { ViewDoc } from "../messages";
import { SensorMark } from "../obstacles/SensorMark";
import { SENSOR_WORDS } from "../obstacles/words";
import { drawnOf, hasSensors, obstacles, type SensorName } from "../store/obstacles";
import { isReplaying } from "../store/review";
import { view } from "../store/state";
import { setView } from "../store/stream";

type Layer = "show_radar_map" | "show_vision_map" | "show_explained" | "show_regions";

interface Key {
  layer: Layer;
  label: string;
  title: string;
  sensor?: SensorName;
}

const KEYS: readonly Key[] = [
  {
    layer: "show_radar_map",
    label: SENSOR_WORDS.radar,
    title: "What the radar has seen on the whole flight: the lighter, the surer",
    sensor: "radar",
  },
  {
    layer: "show_vision_map",
    label: SENSOR_WORDS.vision,
    title: "What the camera and range finders see now: the lighter, the surer",
    sensor: "vision",
  },
  { layer: "show_explained", label: "Known ground", title: "Seen, and known from the surface model" },
  {
    layer: "show_regions",
    label: "Regions",
    title: "What is searched ahead; its edge is thick when it is occupied",
  },
];

const toggle = (layer: Layer) => setView({ [layer]: !view.value[layer] } as Partial<ViewDoc>);

function Sample({ entry }: { entry: Key }) {
  if (entry.sensor) {
    return (
      <>
        <SensorMark sensor={entry.sensor} />
        <span class={`probability sensor-${entry.sensor}`} aria-hidden="true" />
      </>
    );
  }
  return (
    <span class={`swatch ${entry.layer === "show_explained" ? "explained" : "region"}`} aria-hidden="true" />
  );
}

/** Of large maps only so much is drawn that the browser keeps up: the key says how large its boxes are then. */
function Coarser({ sensor }: { sensor: SensorName }) {
  const source = isReplaying.value ? "replay" : "live";
  const drawn = drawnOf(source, sensor);
  if (!drawn || drawn.detail <= 1) return null;
  const { radar_resolution_m, vision_resolution_m } = obstacles[source].value.settings;
  const edge_m = (sensor === "radar" ? radar_resolution_m : vision_resolution_m) * drawn.detail;
  return (
    <span
      class="muted"
      data-testid={`coarser-${sensor}`}
      title={`${number(drawn.drawn)} boxes drawn for ${number(drawn.voxels)} voxels`}
    >
      {metres(edge_m)} boxes
    </span>
  );
}

/** What the colours of the maps mean; each key shows and hides what it stands for. */
export function MapLegend() {
  if (!hasSensors.live.value && !hasSensors.replay.value) return null;
  return (
    <div
      class="map-legend overlay layers"
      role="group"
      aria-label="Maps of obstacles"
      data-testid="map-legend"
    >
      {KEYS.map((entry) => (
        <button
          type="button"
          key={entry.layer}
          title={entry.title}
          aria-pressed={view.value[entry.layer]}
          data-testid={`layer-${entry.layer.slice("show_".length)}`}
          onClick={() => toggle(entry.layer)}
        >
          <span class="eye" aria-hidden="true" />
          <Sample entry={entry} />
          {entry.label}
          {entry.sensor && <Coarser sensor={entry.sensor} />}
        </button>
      ))}
      <span class="probability-scale" aria-hidden="true">
        likely → sure
      </span>
    </div>
  );
}
