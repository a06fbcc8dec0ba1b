import { number } from "../format";
import type { Source } from "../store/flying";
import { SENSORS, sensed, type SensorName } from "../store/obstacles";
import { Icon } from "../ui/Icon";
import { SensorMark } from "./SensorMark";
import { SENSOR_WORDS } from "./words";

const FILES = [
  { format: "ply", note: "points, for any 3D program" },
  { format: "bt", note: "OctoMap" },
  { format: "tif", note: "GeoTIFF of the highest obstacle" },
  { format: "geojson", note: "obstacles with coordinates" },
] as const;

const mapFile = (source: Source, sensor: SensorName, format: string) =>
  `/api/obstacles/map/${sensor}.${format}?source=${source}`;

function Files({ source, sensor }: { source: Source; sensor: SensorName }) {
  return (
    <div class="map-files">
      {FILES.map(({ format, note }) => (
        <a
          key={format}
          class="button"
          href={mapFile(source, sensor, format)}
          download
          title={`${SENSOR_WORDS[sensor]} map as .${format}: ${note}`}
          data-testid={`map-${sensor}-${format}`}
        >
          .{format}
        </a>
      ))}
    </div>
  );
}

/** A finished map as files. */
export function MapExports({ source }: { source: Source }) {
  const known = sensed[source].value;
  const there = SENSORS.filter((sensor) => (known.get(sensor)?.status.voxels_occupied ?? 0) > 0);
  if (there.length === 0) return <p class="hint">Nothing has been seen yet.</p>;
  return (
    <ul class="map-exports" data-testid={`map-exports-${source}`}>
      {there.map((sensor) => (
        <li key={sensor}>
          <p class="row">
            <Icon name="export" size={16} />
            <SensorMark sensor={sensor} />
            <strong>{SENSOR_WORDS[sensor]}</strong>
            <span class="muted">{number(known.get(sensor)?.status.voxels_occupied)} voxels</span>
          </p>
          <Files source={source} sensor={sensor} />
        </li>
      ))}
    </ul>
  );
}
