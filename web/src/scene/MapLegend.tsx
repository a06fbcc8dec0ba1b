import { Changes } from "../ui/Changes";
import { metres, number } from "../format";
import type { ViewDoc } from "../messages";
import { SensorMark } from "../obstacles/SensorMark";
import { SENSOR_WORDS } from "../obstacles/obstacle_words";
import { drawnOf, hasSensors, obstacles, type MapName, type SensorName } from "../store/obstacles";
import { hasTracks } from "../store/moving";
import { hasTraffic } from "../store/traffic";
import { isReplaying } from "../store/review";
import { view } from "../store/state";
import { setView } from "../store/stream";

type Layer =
  | "show_radar_map"
  | "show_vision_map"
  | "show_vision_flight"
  | "show_cloud"
  | "show_explained"
  | "show_regions"
  | "show_tracks"
  | "show_traffic";

interface Key {
  layer: Layer;
  label: string;
  title: string;
  sensor?: SensorName;
  map?: MapName;
}

const KEYS: readonly Key[] = [
  {
    layer: "show_radar_map",
    label: SENSOR_WORDS.radar,
    title: "What the radar has seen on the whole flight: the lighter, the surer",
    sensor: "radar",
    map: "radar",
  },
  {
    layer: "show_vision_map",
    label: SENSOR_WORDS.vision,
    title: "What the camera and range finders see now: the lighter, the surer",
    sensor: "vision",
    map: "vision",
  },
  {
    layer: "show_vision_flight",
    label: "Camera, flight",
    title: "All that the camera has seen on its way; nothing is searched in it",
    sensor: "vision",
    map: "vision_flight",
  },
  {
    layer: "show_cloud",
    label: "Points",
    title: "The camera's newest points, 4,000 at most, twice a second",
  },
  { layer: "show_explained", label: "Known ground", title: "Seen, and known from the surface model" },
  {
    layer: "show_regions",
    label: "Regions",
    title: "What is searched ahead; its edge is thick when it is occupied",
  },
  {
    layer: "show_tracks",
    label: "Moving",
    title: "Moving objects: arrow to where each goes, ellipse of its uncertainty, predicted closest approach",
  },
  {
    layer: "show_traffic",
    label: "Traffic",
    title: "Other aircraft: line to where each is in 15 s, ring of its uncertainty, height difference",
  },
];

const SWATCHES: Partial<Record<Layer, string>> = {
  show_cloud: "points",
  show_explained: "explained",
  show_regions: "region",
};

const toggle = (layer: Layer) => setView({ [layer]: !view.value[layer] } as Partial<ViewDoc>);

/** As drawn in 3D: white, whatever the theme. */
const MovingMark = () => (
  <svg class="moving-mark" viewBox="0 0 20 14" width="20" height="14" aria-hidden="true">
    <path d="M1.5 5.2h8V1.5L18.5 7l-9 5.5V8.8h-8z" />
  </svg>
);

function Sample({ entry }: { entry: Key }) {
  if (entry.sensor) {
    return (
      <>
        <SensorMark sensor={entry.sensor} />
        <span class={`probability sensor-${entry.sensor} map-${entry.map}`} aria-hidden="true" />
      </>
    );
  }
  if (entry.layer === "show_tracks" || entry.layer === "show_traffic") return <MovingMark />;
  return <span class={`swatch ${SWATCHES[entry.layer]}`} aria-hidden="true" />;
}

/** Of large maps only so much is drawn that the browser keeps up: the key says how large its boxes are then. */
function Coarser({ name }: { name: MapName }) {
  const source = isReplaying.value ? "replay" : "live";
  const drawn = drawnOf(source, name);
  if (!drawn || drawn.detail <= 1) return null;
  const { radar_resolution_m, vision_resolution_m } = obstacles[source].value.settings;
  const edge_m = (name === "radar" ? radar_resolution_m : vision_resolution_m) * drawn.detail;
  return (
    <span
      class="muted"
      data-testid={`coarser-${name}`}
      title={`${number(drawn.drawn)} boxes drawn for ${number(drawn.voxels)} voxels`}
    >
      {metres(edge_m)} boxes
    </span>
  );
}

/** What radar and camera have seen on the flight in one picture, and nothing over it (Miccinesi 2022, fig. 22). */
const MERGED: Partial<ViewDoc> = {
  show_radar_map: true,
  show_vision_map: false,
  show_vision_flight: true,
  show_explained: false,
  show_regions: false,
};
const APART: Partial<ViewDoc> = { show_vision_map: true, show_vision_flight: false, show_regions: true };

const isShown = (fields: Partial<ViewDoc>) =>
  Object.entries(fields).every(([name, value]) => view.value[name as keyof ViewDoc] === value);

function MergedMaps() {
  const isMerged = isShown(MERGED);
  return (
    <button
      type="button"
      title="Radar and camera in one picture: all that both have seen on the flight"
      aria-pressed={isMerged}
      data-testid="merged-maps"
      onClick={() => setView(isMerged ? APART : MERGED)}
    >
      <span class="eye" aria-hidden="true" />
      Both maps
    </button>
  );
}

const isAny = ({ live, replay }: typeof hasSensors) => live.value || replay.value;

const HAS: Partial<Record<Layer, typeof hasSensors>> = { show_tracks: hasTracks, show_traffic: hasTraffic };

/** What the colours of the maps mean; each key shows and hides what it stands for. */
export function MapLegend() {
  const all = KEYS.filter(({ layer }) => isAny(HAS[layer] ?? hasSensors));
  if (all.length === 0) return null;
  return (
    <div
      class="map-legend overlay layers"
      role="group"
      aria-label="Maps of obstacles"
      data-testid="map-legend"
    >
      <Changes>
        {all.map((entry) => (
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
            {entry.map && <Coarser name={entry.map} />}
          </button>
        ))}
        {isAny(hasSensors) && <MergedMaps />}
      </Changes>
      <span class="probability-scale" aria-hidden="true">
        likely → sure
      </span>
    </div>
  );
}
