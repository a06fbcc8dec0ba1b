import type uPlot from "uplot";
import type { ResultDoc } from "../messages";
import { drawFlown, drawPois, drawStrip, drawUnknown, drawWorst } from "./draw";
import { chartOptions } from "./options";
import type { Palette } from "./palette";
import { gaps, levelOf, levelSpans, profileRange, type Span } from "./transform";

export interface Size {
  width: number;
  height: number;
}

type Hover = (s_m: number | null) => void;

/** Terrain filled, safe surface, path, the mission as flown, points, the nearest place, the clearance strip. */
export function altitudeChart(
  result: ResultDoc,
  size: Size,
  palette: Palette,
  onHover: Hover,
  flown: Span | null = null,
): uPlot.Options {
  const { chart, worst, required_clearance_m: required_m } = result;
  const spans = levelSpans(chart.trend_s_m, chart.trend_distance_m, required_m);
  const unknown = gaps(chart.s_m, chart.ground_rel_home_m);
  const worstColor = palette[levelOf(result.min_distance_m, required_m)];
  return chartOptions({
    ...size,
    palette,
    yLabel: "m above home",
    range: profileRange(chart, flown),
    series: [
      {
        stroke: palette.groundLine,
        fill: palette.ground,
        width: 1.5,
        points: { show: false },
        fillTo: (u) => u.scales["y"]?.min ?? 0,
      } as uPlot.Series,
      { stroke: palette.surface, width: 5, points: { show: false } },
      { stroke: palette.path, width: 1.75, points: { show: false } },
    ],
    drawUnder: (u) => drawUnknown(u, unknown, palette),
    draw: (u) => {
      drawFlown(u, chart.flown_s_m, chart.flown_rel_home_m, palette);
      drawStrip(u, spans, palette);
      drawPois(u, chart.poi_s_m, chart.poi_names, palette);
      if (worst) drawWorst(u, worst.s_m, worst.alt_rel_home_m, worstColor);
    },
    onHover,
  });
}

export function altitudeData({ chart }: ResultDoc): uPlot.AlignedData {
  return [chart.s_m, chart.ground_rel_home_m, chart.surface_rel_home_m, chart.path_rel_home_m];
}
