import { metres, number } from "../format";
import type { Histogram, ReviewFigures } from "../messages";
import { roundStep, tickDecimals } from "../chart/axes";
import { columns, reachOf } from "./time";

/** In its own units; the labels' size does not change with the chart's. */
const [WIDTH, HEIGHT] = [620, 150];
const BOX = { left: 14, right: WIDTH - 14, top: 48, bottom: HEIGHT - 24 };

const MARKS = [
  { key: "cross_track_mean_m", label: "mean" },
  { key: "cross_track_p95_m", label: "95 %" },
  { key: "cross_track_max_m", label: "max" },
] as const;

/** How often the flight was how far beside the line, with mean, 95th percentile and maximum. */
export function HistogramChart({
  histogram,
  figures,
}: {
  histogram: Histogram;
  figures: ReviewFigures | null;
}) {
  const reach_m = reachOf(histogram, figures?.cross_track_max_m ?? null);
  const x = (share: number) => BOX.left + share * (BOX.right - BOX.left);
  const y = (share: number) => BOX.bottom - share * (BOX.bottom - BOX.top);
  const step = roundStep(reach_m, 6);
  const ticks = Array.from({ length: Math.floor(reach_m / step) + 1 }, (_, index) => index * step);
  return (
    <figure class="histogram" data-testid="histogram">
      <figcaption class="visually-hidden">
        Cross-track error: mean {metres(figures?.cross_track_mean_m, 2)}, 95 % below{" "}
        {metres(figures?.cross_track_p95_m, 2)}, maximum {metres(figures?.cross_track_max_m, 2)}
      </figcaption>
      <svg viewBox={`0 0 ${WIDTH} ${HEIGHT}`} aria-hidden="true">
        {columns(histogram, reach_m).map((column) => (
          <rect
            key={column.from}
            class="column"
            x={x(column.from)}
            width={Math.max(1, x(column.to) - x(column.from) - 1)}
            y={y(column.height)}
            height={BOX.bottom - y(column.height)}
          />
        ))}
        <path class="axis" d={`M${BOX.left} ${BOX.bottom}H${BOX.right}`} />
        {ticks.map((tick) => (
          <text class="tick" key={tick} x={x(tick / reach_m)} y={HEIGHT - 8}>
            {number(tick, tickDecimals(step))}
          </text>
        ))}
        {MARKS.map(({ key, label }, row) => {
          const value = figures?.[key];
          if (value == null) return null;
          const at = x(value / reach_m);
          const isRight = at > WIDTH * 0.6;
          return (
            <g class={`mark ${label === "95 %" ? "p95" : label}`} key={key}>
              <path d={`M${at} ${13 + row * 15 - 9}V${BOX.bottom}`} />
              <text x={at + (isRight ? -4 : 4)} y={13 + row * 15} text-anchor={isRight ? "end" : "start"}>
                {label} {metres(value, 2)}
              </text>
            </g>
          );
        })}
      </svg>
    </figure>
  );
}
