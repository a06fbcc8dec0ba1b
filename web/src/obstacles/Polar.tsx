import { DASH, metres } from "../format";
import type { VehicleState } from "../messages";
import { now_ms } from "../store/clock";
import type { Source } from "../store/flying";
import { SENSORS, sensed } from "../store/obstacles";
import { polarRange_m } from "../store/prefs";
import { sightAge_s, watchOf } from "../store/sensing";
import { Button } from "../ui/Button";
import {
  Blips,
  HALF_HEIGHT,
  HALF_WIDTH,
  Heights,
  North,
  OwnShip,
  Rings,
  Sector,
  Sweep,
  type Shown,
} from "./PolarLayers";
import { SensorMark } from "./SensorMark";
import { nearestOf, nextRange, rings } from "./polar";
import { SENSOR_WORDS, distance, offNose, seenAgo } from "./obstacle_words";

function words(all: readonly Shown[]): string {
  const watching = all.filter((shown) => shown.isWatching);
  if (watching.length === 0) return "Obstacles around: no sensor watches";
  const nearest = nearestOf(watching.map((shown) => shown.sensed.status));
  if (!nearest) return "Obstacles around: none seen";
  return `Obstacles around: nearest ${distance(nearest.distance_m)}, ${offNose(nearest.off_nose_deg)}`;
}

function Nearest({ all }: { all: readonly Shown[] }) {
  const watching = all.filter((shown) => shown.isWatching);
  const nearest = nearestOf(watching.map((shown) => shown.sensed.status));
  return (
    <div class="polar-nearest" data-testid="polar-nearest">
      <span class="muted">Nearest</span>
      <strong>{nearest ? distance(nearest.distance_m) : watching.length > 0 ? "none" : DASH}</strong>
    </div>
  );
}

function Zoom({ range_m }: { range_m: number }) {
  const [nearer, farther] = [nextRange(range_m, -1), nextRange(range_m, 1)];
  return (
    <div class="polar-zoom">
      <Button
        kind="quiet"
        icon="plus"
        title={nearer ? `Show the nearest ${metres(nearer, 0)}` : "This is the smallest circle"}
        disabled={nearer === null}
        testid="polar-nearer"
        onClick={() => nearer && (polarRange_m.value = nearer)}
      />
      <Button
        kind="quiet"
        icon="minus"
        title={farther ? `Show the nearest ${metres(farther, 0)}` : "This is the largest circle"}
        disabled={farther === null}
        testid="polar-farther"
        onClick={() => farther && (polarRange_m.value = farther)}
      />
    </div>
  );
}

/** Which sensor a shape stands for, and which of them does not watch now. */
function Keys({ all }: { all: readonly Shown[] }) {
  return (
    <ul class="polar-keys">
      {all.map(({ sensor, isWatching, ago_s }) => (
        <li key={sensor}>
          <SensorMark sensor={sensor} /> <span class={isWatching ? "" : "off"}>{SENSOR_WORDS[sensor]}</span>
          {!isWatching && <span data-testid={`seen-ago-${sensor}`}>{seenAgo(ago_s)}</span>}
        </li>
      ))}
    </ul>
  );
}

export interface DisplayProps {
  source: Source;
  state: VehicleState | null;
}

/** What is around, seen from above with the nose up: regions, nearest voxels, obstacles with their height. */
export function Polar({ source, state }: DisplayProps) {
  const known = sensed[source].value;
  if (known.size === 0) return null;
  const range_m = polarRange_m.value;
  const all = SENSORS.flatMap((sensor): Shown[] => {
    const entry = known.get(sensor);
    if (!entry) return [];
    const watch = watchOf(entry, source === "live", now_ms.value);
    const ago_s = sightAge_s(entry, source === "live", now_ms.value);
    return [{ sensor, sensed: entry, isWatching: watch === "running", ago_s }];
  });
  const blind = all.every((shown) => !shown.isWatching);
  return (
    <div class={`polar-holder ${blind ? "old" : ""}`}>
      <svg
        class="polar"
        viewBox={`${-HALF_WIDTH} ${-HALF_HEIGHT} ${2 * HALF_WIDTH} ${2 * HALF_HEIGHT}`}
        role="img"
        aria-label={words(all)}
        data-testid="polar"
        data-range={range_m}
      >
        <Rings values={rings(range_m)} unit="m" />
        {all.map((shown) => (
          <Sector key={shown.sensor} shown={shown} range_m={range_m} />
        ))}
        {state?.heading_rad != null && <North heading_rad={state.heading_rad} />}
        {all.map((shown) => (
          <Sweep key={shown.sensor} shown={shown} range_m={range_m} />
        ))}
        {all.map((shown) => (
          <Blips key={shown.sensor} shown={shown} range_m={range_m} />
        ))}
        <OwnShip />
        <Heights all={all.filter((shown) => shown.isWatching)} range_m={range_m} />
        {blind && (
          <text class="polar-blind" y={42}>
            NOT WATCHED
          </text>
        )}
      </svg>
      <Nearest all={all} />
      <Zoom range_m={range_m} />
      <Keys all={all} />
    </div>
  );
}
