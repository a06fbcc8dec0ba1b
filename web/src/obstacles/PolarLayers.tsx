import { degreesOf, number, withUnit } from "../format";
import type { SensorName } from "../store/obstacles";
import type { Sensed } from "../store/sensing";
import { SHAPES } from "./SensorMark";
import { RADIUS, blips, labelled, place, sector, sweepArcs } from "./polar";
import { signedHeight } from "./obstacle_words";

/** What the polar display draws, from below to above. */

export const HALF_WIDTH = 130;
export const HALF_HEIGHT = 106;
/** Ring labels stand where nothing ahead is hidden by them. */
const LABELS_AT_DEG = 140;

export interface Shown {
  sensor: SensorName;
  sensed: Sensed;
  /** What it says is true now: its regions and marks are drawn firmly. */
  isWatching: boolean;
  /** How old what it shows is; null: it watches, or nobody knows. */
  ago_s: number | null;
}

/** Rings around own ship; the last value is the rim's, every second one is written. */
export function Rings({ values, unit }: { values: readonly number[]; unit: string }) {
  const rim = values[values.length - 1]!;
  return (
    <g class="polar-rings">
      {values.map((value, index) => {
        const radius = (value / rim) * RADIUS;
        const { x, y } = place(LABELS_AT_DEG, radius - 9);
        const isLast = index === values.length - 1;
        return (
          <g key={value}>
            <circle r={radius.toFixed(1)} class={isLast ? "rim" : ""} />
            {(isLast || index % 2 === 1) && (
              <text x={x.toFixed(1)} y={(y + 4).toFixed(1)}>
                {isLast ? withUnit(value, unit) : number(value)}
              </text>
            )}
          </g>
        );
      })}
      <path d={`M0 ${-RADIUS}V${RADIUS}M${-RADIUS} 0H${RADIUS}`} />
    </g>
  );
}

/** Where north is, with the nose up. */
export function North({ heading_rad }: { heading_rad: number }) {
  const { x, y } = place(-degreesOf(heading_rad), RADIUS - 8);
  return (
    <g class="polar-north" transform={`translate(${x.toFixed(1)} ${y.toFixed(1)})`}>
      <circle r={9} />
      <text y={5}>N</text>
    </g>
  );
}

export function Sector({ shown, range_m }: { shown: Shown; range_m: number }) {
  const { region } = shown.sensed.status;
  if (!region) return null;
  const state = !shown.isWatching ? "off" : region.occupied ? "occupied" : "clear";
  return <path class={`polar-sector ${state}`} d={sector(region, range_m)} />;
}

export function Sweep({ shown, range_m }: { shown: Shown; range_m: number }) {
  return (
    <g class={`polar-sweep sensor-${shown.sensor} ${shown.isWatching ? "" : "old"}`}>
      {sweepArcs(shown.sensed.status.sweep_m, range_m).map((arc) => (
        <path key={arc.path} d={arc.path} />
      ))}
    </g>
  );
}

export function Blips({ shown, range_m }: { shown: Shown; range_m: number }) {
  const all = blips(shown.sensed.status, range_m);
  return (
    <g class={`polar-blips sensor-${shown.sensor} ${shown.isWatching ? "" : "old"}`}>
      {all.map((blip, index) => (
        <g key={index} transform={`translate(${blip.x.toFixed(1)} ${blip.y.toFixed(1)})`}>
          <path d={SHAPES[shown.sensor]} />
          {blip.isBeyond && (
            <path class="beyond" d="M-7-8 0-15 7-8" transform={`rotate(${blip.off_nose_deg})`} />
          )}
        </g>
      ))}
    </g>
  );
}

/** Height differences over everything else, on a ground of their own. */
export function Heights({ all, range_m }: { all: readonly Shown[]; range_m: number }) {
  const every = all.flatMap((shown) => blips(shown.sensed.status, range_m));
  const nearestFirst = every.sort((a, b) => a.distance_m - b.distance_m);
  return (
    <g class="polar-heights">
      {labelled(nearestFirst).map((blip, index) => {
        const isLeft = blip.x > HALF_WIDTH - 44;
        return (
          <text
            key={index}
            x={(blip.x + (isLeft ? -9 : 9)).toFixed(1)}
            y={(blip.y + 5).toFixed(1)}
            text-anchor={isLeft ? "end" : "start"}
          >
            {signedHeight(blip.height_difference_m)}
          </text>
        );
      })}
    </g>
  );
}

export const OwnShip = () => <path class="polar-ship" d="M0-11 8 8 0 4-8 8z" />;
