import type { ComponentChildren } from "preact";
import { useRef } from "preact/hooks";
import { useSize } from "../chart/ChartBox";
import { ticks } from "../chart/axes";

export interface Area {
  left: number;
  top: number;
  width: number;
  height: number;
  x: (value: number) => number;
  y: (value: number) => number;
}

interface Props {
  testid: string;
  label: string;
  xLabel: string;
  yLabel: string;
  xSpan: readonly [number, number];
  ySpan: readonly [number, number];
  /** As many metres in both directions. */
  isTrue?: boolean;
  /** What lies under the lines: a canvas at the area's place. */
  under?: (area: Area) => ComponentChildren;
  /** SVG over it, in pixels of the whole frame. */
  over: (area: Area) => ComponentChildren;
  onPoint?: (x: number | null, y: number | null) => void;
}

const EDGE = { left: 60, right: 12, top: 8, bottom: 40 };
const LEAST = { width: 160, height: 120 };
const [PX_PER_X_TICK, PX_PER_Y_TICK] = [56, 40];

function areaIn(size: { width: number; height: number }, props: Props): Area {
  const { xSpan, ySpan } = props;
  let width = size.width - EDGE.left - EDGE.right;
  let height = size.height - EDGE.top - EDGE.bottom;
  if (props.isTrue) {
    const scale = Math.min(width / (xSpan[1] - xSpan[0]), height / (ySpan[1] - ySpan[0]));
    width = Math.floor(scale * (xSpan[1] - xSpan[0]));
    height = Math.floor(scale * (ySpan[1] - ySpan[0]));
  }
  const left = EDGE.left + Math.max(0, (size.width - EDGE.left - EDGE.right - width) / 2);
  const x = (value: number) => left + ((value - xSpan[0]) / (xSpan[1] - xSpan[0])) * width;
  const y = (value: number) => EDGE.top + ((ySpan[1] - value) / (ySpan[1] - ySpan[0])) * height;
  return { left, top: EDGE.top, width, height, x, y };
}

function Axes({ area, props }: { area: Area; props: Props }) {
  const { left, top, width, height } = area;
  const bottom = top + height;
  return (
    <g class="axes">
      {ticks(props.xSpan[0], props.xSpan[1], width / PX_PER_X_TICK).map(({ at, text }) => (
        <g key={`x${at}`}>
          <path d={`M${area.x(at)} ${bottom}v5`} />
          <text x={area.x(at)} y={bottom + 18} text-anchor="middle">
            {text}
          </text>
        </g>
      ))}
      {ticks(props.ySpan[0], props.ySpan[1], height / PX_PER_Y_TICK).map(({ at, text }) => (
        <g key={`y${at}`}>
          <path d={`M${left} ${area.y(at)}h-5`} />
          <text x={left - 8} y={area.y(at) + 4} text-anchor="end">
            {text}
          </text>
        </g>
      ))}
      <rect x={left} y={top} width={width} height={height} />
      <text class="axis-label" x={left + width / 2} y={bottom + 35} text-anchor="middle">
        {props.xLabel}
      </text>
      <text
        class="axis-label"
        transform={`translate(${left - 48} ${top + height / 2}) rotate(-90)`}
        text-anchor="middle"
      >
        {props.yLabel}
      </text>
    </g>
  );
}

/** A drawing with axes in their units that fills the place it is given. */
export function PlotFrame(props: Props) {
  const box = useRef<HTMLDivElement>(null);
  const size = useSize(box);
  const isLargeEnough = size !== null && size.width >= LEAST.width && size.height >= LEAST.height;
  const area = isLargeEnough ? areaIn(size, props) : null;
  const point = (event: PointerEvent) => {
    if (!area || !props.onPoint) return;
    const frame = (event.currentTarget as Element).getBoundingClientRect();
    const [x_px, y_px] = [event.clientX - frame.left - area.left, event.clientY - frame.top - area.top];
    const isInside = x_px >= 0 && y_px >= 0 && x_px <= area.width && y_px <= area.height;
    if (!isInside) return props.onPoint(null, null);
    const { xSpan, ySpan } = props;
    props.onPoint(
      xSpan[0] + (x_px / area.width) * (xSpan[1] - xSpan[0]),
      ySpan[1] - (y_px / area.height) * (ySpan[1] - ySpan[0]),
    );
  };
  return (
    <div
      class="plot-frame"
      ref={box}
      data-testid={props.testid}
      onPointerMove={point}
      onPointerLeave={() => props.onPoint?.(null, null)}
    >
      {area && size && (
        <>
          {props.under?.(area)}
          <svg width={size.width} height={size.height} role="img" aria-label={props.label}>
            <Axes area={area} props={props} />
            {props.over(area)}
          </svg>
        </>
      )}
    </div>
  );
}
