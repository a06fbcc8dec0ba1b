import uPlot from "uplot";
import { number } from "../format";
import { CHART_FONT, type Palette } from "./palette";
import { tickDecimals, type Span } from "./transform";

/** What both charts have in common: axes with units, no zoom, no legend of uPlot's own. */
interface Frame {
  width: number;
  height: number;
  palette: Palette;
  yLabel: string;
  range: Span;
  series: uPlot.Series[];
  draw: (u: uPlot) => void;
  drawUnder: (u: uPlot) => void;
  onHover: (s_m: number | null) => void;
}

function axis(palette: Palette): Partial<uPlot.Axis> {
  return {
    stroke: palette.muted,
    font: CHART_FONT,
    labelFont: CHART_FONT,
    grid: { stroke: palette.grid, width: 1 },
    ticks: { stroke: palette.grid, width: 1, size: 5 },
  };
}

const ticks = (_: uPlot, values: number[]) => {
  const decimals = tickDecimals(Math.abs((values[1] ?? 1) - (values[0] ?? 0)));
  return values.map((value) => number(value, decimals));
};

function hoverPlugin(onHover: Frame["onHover"]): uPlot.Plugin {
  return {
    hooks: {
      ready: (u) => {
        u.over.addEventListener("pointermove", (event) => {
          const { left } = u.over.getBoundingClientRect();
          onHover(u.posToVal(event.clientX - left, "x"));
        });
        u.over.addEventListener("pointerleave", () => onHover(null));
      },
    },
  };
}

export function chartOptions(frame: Frame): uPlot.Options {
  const { palette } = frame;
  return {
    width: frame.width,
    height: frame.height,
    padding: [22, 16, 0, 0],
    legend: { show: false },
    cursor: { drag: { x: false, y: false }, points: { show: false }, y: false, x: false },
    scales: {
      x: { time: false, range: (_, min, max) => [min, max > min ? max : min + 1] },
      y: { range: () => [frame.range[0], frame.range[1]] },
    },
    axes: [
      { ...axis(palette), size: 28, values: ticks, space: 80 },
      {
        ...axis(palette),
        size: 58,
        values: ticks,
        space: 34,
        label: frame.yLabel,
        labelSize: 22,
        labelGap: 0,
      },
    ],
    series: [{}, ...frame.series],
    hooks: { drawAxes: [frame.drawUnder], draw: [frame.draw] },
    plugins: [hoverPlugin(frame.onHover)],
  };
}
