import { useCallback, useMemo, useRef } from "preact/hooks";
import { useComputed } from "@preact/signals";
import type uPlot from "uplot";
import type { ResultDoc } from "../messages";
import { trackVersion, tracks } from "../store/flying";
import { cursor } from "../store/state";
import { ChartBox, VerticalLine } from "./ChartBox";
import { FlownLayer } from "./FlownLayer";
import { altitudeChart, altitudeData, type Size } from "./altitude";
import type { Palette } from "./palette";
import { flownSpan, type Span } from "./transform";
import { trendChart, trendData } from "./trend";

export type ChartKind = "altitude" | "distance";

const CHARTS = {
  altitude: { options: altitudeChart, data: altitudeData },
  distance: { options: trendChart, data: trendData },
} as const;

interface Props {
  kind: ChartKind;
  result: ResultDoc;
  /** Whether the flown path and the vehicle are drawn as well. */
  flown: boolean;
  onHover: (s_m: number | null) => void;
}

/** The vertical line at the place marked in profile and 3D view at once. */
function CursorLine({ plot }: { plot: uPlot }) {
  return <VerticalLine plot={plot} at={cursor.value?.s_m ?? null} kind="" testid="cursor-line" />;
}

/** What was flown, as far as the axis must follow it: the same object until that changes. */
function useFlownSpan(flown: boolean): Span | null {
  const ends = useComputed(() => {
    void trackVersion.live.value;
    return flownSpan(tracks.live.s_m, tracks.live.alt_rel_home_m)?.join() ?? "";
  });
  const text = flown ? ends.value : "";
  return useMemo(() => {
    const [low, high] = text.split(",").map(Number);
    return text === "" || low === undefined || high === undefined ? null : [low, high];
  }, [text]);
}

/** The profile along the path. */
export function Plot({ kind, result, flown, onHover }: Props) {
  const hover = useRef(onHover);
  hover.current = onHover;
  const span = useFlownSpan(flown && kind === "altitude");
  const make = useCallback(
    (size: Size, palette: Palette) => ({
      options: CHARTS[kind].options(result, size, palette, (s_m) => hover.current(s_m), span),
      data: CHARTS[kind].data(result),
    }),
    [kind, result, span],
  );
  const over = (plot: uPlot) => (
    <>
      {flown && kind === "altitude" && <FlownLayer plot={plot} />}
      <CursorLine plot={plot} />
    </>
  );
  return <ChartBox make={make} testid="profile-chart" kind={kind} over={over} />;
}
