import { number } from "../format";
import { active } from "../store/fleet";
import type { Source } from "../store/flying";
import { SENSORS, sensed, type MapName, type SensorName } from "../store/obstacles";
import { Icon } from "../ui/Icon";
import { SensorMark } from "./SensorMark";
import { SENSOR_WORDS } from "./obstacle_words";

const FILES = [
  { format: "ply", note: "points, for any 3D program" },
  { format: "pcd", note: "points, for the Point Cloud Library" },
  { format: "bt", note: "OctoMap" },
  { format: "mcap", note: "OctoMap in a ROS 2 bag" },
  { format: "tif", note: "GeoTIFF of the highest obstacle" },
  { format: "geojson", note: "obstacles with coordinates" },
] as const;

const mapFile = (source: Source, name: MapName, format: string) =>
  `/api/obstacles/map/${name}.${format}?source=${source}&vehicle=${active.value}`;

interface Known {
  name: MapName;
  sensor: SensorName;
  words: string;
  voxels: number;
}

/** What there is to take out: each sensor's map, and all that the camera has seen on its way. */
function knownMaps(source: Source): Known[] {
  return SENSORS.flatMap((sensor): Known[] => {
    const status = sensed[source].value.get(sensor)?.status;
    const voxels = status?.voxels_occupied ?? 0;
    const flight = status?.flight_map?.voxels_occupied ?? 0;
    const own: Known = { name: sensor, sensor, words: SENSOR_WORDS[sensor], voxels };
    const whole: Known = { name: "vision_flight", sensor, words: "Camera, whole flight", voxels: flight };
    return [own, whole].filter((entry) => entry.voxels > 0);
  });
}

function Files({ source, known }: { source: Source; known: Known }) {
  return (
    <div class="map-files">
      {FILES.map(({ format, note }) => (
        <a
          key={format}
          class="button"
          href={mapFile(source, known.name, format)}
          download
          title={`${known.words}: map as .${format}: ${note}`}
          data-testid={`map-${known.name}-${format}`}
        >
          .{format}
        </a>
      ))}
    </div>
  );
}

/** A finished map as files. */
export function MapExports({ source }: { source: Source }) {
  const there = knownMaps(source);
  if (there.length === 0) return <p class="hint">Nothing has been seen yet.</p>;
  return (
    <ul class="map-exports" data-testid={`map-exports-${source}`}>
      {there.map((known) => (
        <li key={known.name}>
          <p class="row">
            <Icon name="export" size={16} />
            <SensorMark sensor={known.sensor} />
            <strong>{known.words}</strong>
            <span class="muted">{number(known.voxels)} voxels</span>
          </p>
          <Files source={source} known={known} />
        </li>
      ))}
    </ul>
  );
}
