import uPlot from "uplot";
import { number } from "../format";
import { CHART_FONT, type Palette } from "./palette";
import { tickDecimals } from "./axes";
import type { Span } from "./transform";

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
  onHover: (at: number | null) => void;
  /** The place under the pressed pointer, where a press means something. */
  onPick?: (at: number, isOver: boolean) => void;
  /** Of the horizontal axis; what the curves cover if left out. */
  xRange?: Span;
  /** How the horizontal axis is written; in metres if left out. */
  xText?: (value: number) => string;
  /** Room above the chart, for names of places. */
  top?: number;
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

/** Steps of a time axis that people count in. */
const CLOCK_STEPS_S = [1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600];

const ticks = (_: uPlot, values: number[]) => {
  const decimals = tickDecimals(Math.abs((values[1] ?? 1) - (values[0] ?? 0)));
  return values.map((value) => number(value, decimals));
};

/** Pressing and dragging picks places along the horizontal axis. */
function pickPlugin(onPick: NonNullable<Frame["onPick"]>): uPlot.Plugin {
  const ready = (u: uPlot) => {
    const at = (event: PointerEvent) => {
      const { left, width } = u.over.getBoundingClientRect();
      return u.posToVal(Math.min(width, Math.max(0, event.clientX - left)), "x");
    };
    u.over.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      u.over.setPointerCapture(event.pointerId);
      onPick(at(event), false);
    });
    u.over.addEventListener("pointermove", (event) => {
      if (u.over.hasPointerCapture(event.pointerId)) onPick(at(event), false);
    });
    // Also when the gesture is taken away from the page.
    u.over.addEventListener("lostpointercapture", (event) => onPick(at(event), true));
  };
  return { hooks: { ready } };
}

/** A range without a length still gets one. */
const spread = ([from, to]: Span): [number, number] => [from, to > from ? to : from + 1];

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
  const { palette, onPick, xText } = frame;
  const xTicks = xText ? (_: uPlot, values: number[]) => values.map(xText) : ticks;
  return {
    width: frame.width,
    height: frame.height,
    padding: [frame.top ?? 22, 16, 0, 0],
    legend: { show: false },
    cursor: { drag: { x: false, y: false }, points: { show: false }, y: false, x: false },
    scales: {
      x: { time: false, range: (_, min, max) => spread(frame.xRange ?? [min, max]) },
      y: { range: () => [frame.range[0], frame.range[1]] },
    },
    axes: [
      { ...axis(palette), size: 28, values: xTicks, space: 80, ...(xText ? { incrs: CLOCK_STEPS_S } : {}) },
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
    plugins: [hoverPlugin(frame.onHover), ...(onPick ? [pickPlugin(onPick)] : [])],
  };
}
