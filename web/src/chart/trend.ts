import type uPlot from "uplot";
import { metres } from "../format";
import type { ResultDoc } from "../messages";
import type { Size } from "./altitude";
import { drawLevel, drawPois, drawStrip, drawUnknown, drawWorst } from "./draw";
import { chartOptions } from "./options";
import type { Palette } from "./palette";
import { gaps, heightRange, levelOf, levelSpans } from "./transform";

/** The distance in space to the surface model along the flown line, against what is required. */
export function trendChart(
  result: ResultDoc,
  size: Size,
  palette: Palette,
  onHover: (s_m: number | null) => void,
): uPlot.Options {
  const { chart, worst, required_clearance_m: required_m } = result;
  const spans = levelSpans(chart.trend_s_m, chart.trend_distance_m, required_m);
  const unknown = gaps(chart.trend_s_m, chart.trend_distance_m);
  const [, high] = heightRange([chart.trend_distance_m, [required_m]]);
  return chartOptions({
    ...size,
    palette,
    yLabel: "m to surface",
    range: [0, high],
    series: [{ stroke: palette.path, width: 2, points: { show: false } }],
    drawUnder: (u) => drawUnknown(u, unknown, palette),
    draw: (u) => {
      drawLevel(u, required_m, `required ${metres(required_m, 2)}`, palette);
      drawStrip(u, spans, palette);
      drawPois(u, chart.poi_s_m, chart.poi_names, palette);
      const color = palette[levelOf(result.min_distance_m, required_m)];
      if (worst && result.min_distance_m !== null) drawWorst(u, worst.s_m, result.min_distance_m, color);
    },
    onHover,
  });
}

export function trendData({ chart }: ResultDoc): uPlot.AlignedData {
  return [chart.trend_s_m, chart.trend_distance_m];
}
