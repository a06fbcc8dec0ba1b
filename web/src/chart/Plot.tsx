import { useEffect, useRef, useState } from "preact/hooks";
import uPlot from "uplot";
import type { ResultDoc } from "../messages";
import { cursor } from "../store/state";
import { theme } from "../store/prefs";
import { altitudeChart, altitudeData, type Size } from "./altitude";
import { readPalette } from "./palette";
import { trendChart, trendData } from "./trend";

export type ChartKind = "altitude" | "distance";

const CHARTS = {
  altitude: { options: altitudeChart, data: altitudeData },
  distance: { options: trendChart, data: trendData },
} as const;

interface Props {
  kind: ChartKind;
  result: ResultDoc;
  onHover: (s_m: number | null) => void;
}

function useSize(ref: { current: HTMLElement | null }): Size | null {
  const [size, setSize] = useState<Size | null>(null);
  useEffect(() => {
    const element = ref.current;
    if (!element) return undefined;
    const observer = new ResizeObserver(() => {
      const { clientWidth: width, clientHeight: height } = element;
      setSize((old) => (old?.width === width && old.height === height ? old : { width, height }));
    });
    observer.observe(element);
    return () => observer.disconnect();
  }, []);
  return size;
}

/** The vertical line at the place marked in profile and 3D view at once. */
function CursorLine({ plot, s_m }: { plot: uPlot | null; s_m: number | null }) {
  if (!plot || s_m === null) return null;
  const left = plot.over.offsetLeft + plot.valToPos(s_m, "x");
  const isInside =
    left >= plot.over.offsetLeft - 1 && left <= plot.over.offsetLeft + plot.over.clientWidth + 1;
  if (!isInside) return null;
  const style = { left: `${left}px`, top: `${plot.over.offsetTop}px`, height: `${plot.over.clientHeight}px` };
  return <span class="cursor-line" style={style} data-testid="cursor-line" />;
}

/** uPlot in a box that it fills; drawn anew when result, theme or size change. */
export function Plot({ kind, result, onHover }: Props) {
  const box = useRef<HTMLDivElement>(null);
  const hover = useRef(onHover);
  hover.current = onHover;
  const size = useSize(box);
  const [plot, setPlot] = useState<uPlot | null>(null);
  const colors = theme.value;
  useEffect(() => {
    if (!box.current || !size || size.width < 80 || size.height < 60) return undefined;
    const { options, data } = CHARTS[kind];
    const made = new uPlot(
      options(result, size, readPalette(), (s_m) => hover.current(s_m)),
      data(result),
      box.current,
    );
    setPlot(made);
    return () => {
      made.destroy();
      setPlot(null);
    };
  }, [kind, result, size, colors]);
  return (
    <div class="plot" data-testid="profile-chart" data-kind={kind}>
      <div class="plot-box" ref={box} />
      <CursorLine plot={plot} s_m={cursor.value?.s_m ?? null} />
    </div>
  );
}
