import type uPlot from "uplot";
import type { ReviewDoc } from "../messages";
import type { Size } from "../chart/altitude";
import { drawUnknown } from "../chart/draw";
import { chartOptions } from "../chart/options";
import type { Palette } from "../chart/palette";
import { gaps, heightRange } from "../chart/transform";
import { axisTime } from "./time";

export interface Pointing {
  hover: (at_s: number | null) => void;
  pick: (at_s: number, isOver: boolean) => void;
}

interface Made {
  options: uPlot.Options;
  data: uPlot.AlignedData;
}

/** Nothing is written above these charts. */
const TOP_PX = 8;

/** What the charts over a flight's time share: its length, and where the pointer is. */
const overTime = (review: ReviewDoc, pointing: Pointing) => ({
  onHover: pointing.hover,
  onPick: pointing.pick,
  xRange: [0, review.duration_s] as [number, number],
  xText: axisTime,
  top: TOP_PX,
});

const noPoints = { points: { show: false } };

/** Altitude above home against time: ground, what was flown, the plan at the nearest place and by its own clock. */
export function altitudeOverTime(review: ReviewDoc, size: Size, palette: Palette, pointing: Pointing): Made {
  const { t_s, ground_rel_home_m, reference_alt_rel_home_m, planned_alt_rel_home_m, alt_rel_home_m } =
    review.series;
  const unknown = gaps(t_s, ground_rel_home_m);
  const options = chartOptions({
    ...size,
    palette,
    yLabel: "m above home",
    range: heightRange([ground_rel_home_m, reference_alt_rel_home_m, planned_alt_rel_home_m, alt_rel_home_m]),
    series: [
      {
        stroke: palette.groundLine,
        fill: palette.ground,
        width: 1.5,
        ...noPoints,
        fillTo: (u) => u.scales["y"]?.min ?? 0,
      } as uPlot.Series,
      { stroke: palette.replayed, width: 2.5, ...noPoints },
      { stroke: palette.path, width: 1.75, dash: [7, 5], ...noPoints },
      { stroke: palette.surface, width: 2, ...noPoints },
    ],
    drawUnder: (u) => drawUnknown(u, unknown, palette),
    draw: () => undefined,
    ...overTime(review, pointing),
  });
  const curves = [ground_rel_home_m, alt_rel_home_m, reference_alt_rel_home_m, planned_alt_rel_home_m];
  return { options, data: [t_s, ...curves] };
}

/** Cross-track error against time, right of the line positive. */
export function crossTrackOverTime(
  review: ReviewDoc,
  size: Size,
  palette: Palette,
  pointing: Pointing,
): Made {
  const { t_s, cross_track_m } = review.series;
  const sizes = cross_track_m.map((value) => (value === null ? null : Math.abs(value)));
  const most = Math.max(0.1, ...sizes.map((value) => value ?? 0)) * 1.1;
  const options = chartOptions({
    ...size,
    palette,
    yLabel: "m right of line",
    range: [-most, most],
    series: [{ stroke: palette.replayed, width: 2, ...noPoints }],
    drawUnder: () => undefined,
    draw: () => undefined,
    ...overTime(review, pointing),
  });
  return { options, data: [t_s, cross_track_m] };
}
