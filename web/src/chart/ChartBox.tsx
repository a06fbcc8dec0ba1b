import type { ComponentChildren } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";
import uPlot from "uplot";
import { theme } from "../store/prefs";
import type { Size } from "./altitude";
import { readPalette, type Palette } from "./palette";

interface Props {
  /** Makes the chart; a new function makes a new chart. */
  make: (size: Size, palette: Palette) => { options: uPlot.Options; data: uPlot.AlignedData };
  testid: string;
  kind: string;
  /** What lies over it, placed by the chart's own scales. */
  over?: (plot: uPlot) => ComponentChildren;
}

const LEAST = { width: 80, height: 60 };

/** How large an element is, as it changes. */
export function useSize(ref: { current: HTMLElement | null }): Size | null {
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

/** A vertical line on a chart, if it lies within it. */
export function VerticalLine(props: { plot: uPlot; at: number | null; kind: string; testid: string }) {
  const { plot, at, kind, testid } = props;
  if (at === null) return null;
  const left = plot.over.offsetLeft + plot.valToPos(at, "x");
  const isInside =
    left >= plot.over.offsetLeft - 1 && left <= plot.over.offsetLeft + plot.over.clientWidth + 1;
  if (!isInside) return null;
  const style = { left: `${left}px`, top: `${plot.over.offsetTop}px`, height: `${plot.over.clientHeight}px` };
  return <span class={`cursor-line ${kind}`} style={style} data-testid={testid} />;
}

/** uPlot in a box that it fills; drawn anew when its making, the theme or the size change. */
export function ChartBox({ make, testid, kind, over }: Props) {
  const box = useRef<HTMLDivElement>(null);
  const size = useSize(box);
  const [plot, setPlot] = useState<uPlot | null>(null);
  const colors = theme.value;
  useEffect(() => {
    if (!box.current || !size || size.width < LEAST.width || size.height < LEAST.height) return undefined;
    const { options, data } = make(size, readPalette());
    // What lies over it needs its scales: those are known once it is drawn.
    const ready = [...[options.hooks?.ready ?? []].flat(), (drawn: uPlot) => setPlot(drawn)];
    const made = new uPlot({ ...options, hooks: { ...options.hooks, ready } }, data, box.current);
    return () => {
      made.destroy();
      setPlot(null);
    };
  }, [make, size, colors]);
  return (
    <div class="plot" data-testid={testid} data-kind={kind}>
      <div class="plot-box" ref={box} />
      {plot && over?.(plot)}
    </div>
  );
}
