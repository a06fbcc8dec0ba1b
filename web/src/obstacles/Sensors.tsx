import { metres, number, withUnit } from "../format";
import { now_ms } from "../store/clock";
import type { Source } from "../store/flying";
import { SENSORS, drawnOf, sensed, type SensorName } from "../store/obstacles";
import { silence_s, watchOf, type Sensed } from "../store/sensing";
import { Icon } from "../ui/Icon";
import { SensorMark } from "./SensorMark";
import { SENSOR_WORDS, WATCH_WORDS, sensorRow } from "./obstacle_words";

/** The camera's own path may part from the satellites' by so much before it matters. */
const DIVERGENCE_M = 2;

function Notes({ sensor, entry, source }: { sensor: SensorName; entry: Sensed; source: Source }) {
  const { text, divergence_m, flight_map } = entry.status;
  const drawn = drawnOf(source, sensor);
  return (
    <>
      {text && <p class="sensor-says">{text}</p>}
      {divergence_m !== null && (
        <p class={`sensor-says ${divergence_m > DIVERGENCE_M ? "near" : "muted"}`} data-testid="divergence">
          {divergence_m > DIVERGENCE_M && <Icon name="warning" size={16} />}
          {metres(divergence_m)} between its path and the GNSS path
        </p>
      )}
      {flight_map && (
        <p class="sensor-says muted" data-testid="flight-map" title={flight_map.why}>
          {number(flight_map.voxels_occupied)} voxels on the whole flight
          {flight_map.part > 1 && `, part ${flight_map.part}: its path broke off`}
        </p>
      )}
      {drawn && drawn.text && (
        <p class="sensor-says muted">
          {drawn.text} ({number(drawn.drawn)} of {number(drawn.voxels)})
        </p>
      )}
    </>
  );
}

function Row({ sensor, entry, source }: { sensor: SensorName; entry: Sensed; source: Source }) {
  const isLive = source === "live";
  const watch = watchOf(entry, isLive, now_ms.value);
  const { word, level } = WATCH_WORDS[watch];
  const row = sensorRow(entry);
  const silent_s = silence_s(entry, isLive, now_ms.value);
  return (
    <li class={`sensor ${level}`} data-testid={`sensor-${sensor}`} data-state={watch}>
      <p class="sensor-head">
        <SensorMark sensor={sensor} />
        <strong>{SENSOR_WORDS[sensor]}</strong>
        <span class="sensor-state">
          {level === "bad" && <Icon name="warning" size={16} />}
          {word}
          {silent_s !== null && ` for ${withUnit(Math.floor(silent_s), "s")}`}
        </span>
      </p>
      <dl>
        <div>
          <dt>Rate</dt>
          <dd>{row.rate}</dd>
        </div>
        <div>
          <dt>Latency</dt>
          <dd>{row.latency}</dd>
        </div>
        <div>
          <dt>Voxels</dt>
          <dd>{row.voxels}</dd>
        </div>
      </dl>
      {row.lost && (
        <details class="details sensor-lost">
          <summary>{row.lost}</summary>
          <ul>
            {row.reasons.map((reason) => (
              <li key={reason}>{reason}</li>
            ))}
          </ul>
        </details>
      )}
      <Notes sensor={sensor} entry={entry} source={source} />
    </li>
  );
}

/** How each sensor does: whether it watches, how often, how late, what its map holds and what was refused. */
export function Sensors({ source }: { source: Source }) {
  const known = sensed[source].value;
  if (known.size === 0) return null;
  return (
    <section class="instrument sensors" aria-label="Sensors" data-testid={`sensors-${source}`}>
      <h2>Sensors</h2>
      <ul>
        {SENSORS.map((sensor) => {
          const entry = known.get(sensor);
          return entry && <Row key={sensor} sensor={sensor} entry={entry} source={source} />;
        })}
      </ul>
    </section>
  );
}
