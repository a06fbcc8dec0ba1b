import { signal } from "@preact/signals";
import { useCallback, useEffect, useState } from "preact/hooks";
import { deviation, metres, timecode, withUnit } from "../format";
import type { ReviewDoc } from "../messages";
import { ChartBox, VerticalLine } from "../chart/ChartBox";
import { ResizeHandle } from "../chart/ResizeHandle";
import type { Size } from "../chart/altitude";
import type { Palette } from "../chart/palette";
import { chartHeight_px } from "../store/prefs";
import { isPlaying, opening, playhead, playhead_s, replay, review, seek, seeking } from "../store/review";
import { Segmented } from "../ui/Button";
import { HistogramChart } from "./HistogramChart";
import { Transport } from "./Transport";
import { altitudeOverTime, crossTrackOverTime, type Pointing } from "./charts";
import { alertTimes, momentAt } from "./time";

type Tab = "altitude" | "cross_track" | "histogram" | "both";

const tab = signal<Tab>("altitude");
const hovered_s = signal<number | null>(null);
const pointing: Pointing = { hover: (at_s) => (hovered_s.value = at_s), pick: seek };

const CHARTS = { altitude: altitudeOverTime, cross_track: crossTrackOverTime } as const;

/** Moves smoothly while playing: the page's clock ticks too seldom for an eye. */
function Playhead({ plot }: { plot: Parameters<typeof VerticalLine>[0]["plot"] }) {
  const [, draw] = useState(0);
  const playing = isPlaying.value;
  useEffect(() => {
    if (!playing) return undefined;
    let frame = requestAnimationFrame(function next(now) {
      draw(now);
      frame = requestAnimationFrame(next);
    });
    return () => cancelAnimationFrame(frame);
  }, [playing]);
  const at = playing ? (seeking.value?.at_s ?? playhead(replay.value, performance.now())) : playhead_s.value;
  return <VerticalLine plot={plot} at={at} kind="playhead" testid="playhead" />;
}

function TimeChart({ kind, open }: { kind: keyof typeof CHARTS; open: ReviewDoc }) {
  const make = useCallback(
    (size: Size, palette: Palette) => CHARTS[kind](open, size, palette, pointing),
    [kind, open],
  );
  return (
    <ChartBox
      make={make}
      testid={`time-chart-${kind}`}
      kind={kind}
      over={(plot) => (
        <>
          {alertTimes(open.events).map((at_s) => (
            <VerticalLine key={at_s} plot={plot} at={at_s} kind="alert-line" testid="alert-mark" />
          ))}
          <VerticalLine plot={plot} at={hovered_s.value} kind="hovered" testid="hover-line" />
          <Playhead plot={plot} />
        </>
      )}
    />
  );
}

/** What holds at the pointer, or else where the replay is. */
function Values({ open, shown }: { open: ReviewDoc; shown: Tab }) {
  const at_s = hovered_s.value ?? playhead_s.value;
  if (at_s === null) return null;
  const moment = momentAt(open.series, at_s);
  return (
    <dl class="cursor-values" data-testid="time-values">
      {hovered_s.value !== null && (
        <>
          <dt>at</dt>
          <dd>{timecode(at_s)}</dd>
        </>
      )}
      {shown === "altitude" ? (
        <>
          <dt>flown</dt>
          <dd>{metres(moment.flown_m)}</dd>
          <dt>plan</dt>
          <dd>{metres(moment.reference_m)}</dd>
        </>
      ) : (
        <>
          <dt>beside</dt>
          <dd class="wide-value">{deviation(moment.cross_track_m, { more: "right", less: "left" })}</dd>
        </>
      )}
      <dt class="optional">to DSM</dt>
      <dd class="optional">{metres(moment.distance_m, 2)}</dd>
    </dl>
  );
}

function Keys({ open }: { open: ReviewDoc }) {
  const lag_s = open.figures?.lag_s ?? null;
  return (
    <span class="chart-keys" aria-hidden="true">
      <span class="key ground">Ground</span>
      <span class="key reference" title="The plan at the nearest place of its line">
        Plan
      </span>
      {lag_s !== null && (
        <span class="key on-time" title="Where the plan's own clock is, from the first waypoint on">
          Plan on time
        </span>
      )}
      <span class="key track">Flown{lag_s === null ? "" : `, lag ${withUnit(lag_s, "s", 1)}`}</span>
      {alertTimes(open.events).length > 0 && <span class="key alert-key">Alert</span>}
    </span>
  );
}

/** From this height on both charts fit above each other. */
const BOTH_PX = 400;

function Charts({ open, shown }: { open: ReviewDoc; shown: Tab }) {
  const distribution = open.histogram ? (
    <HistogramChart histogram={open.histogram} figures={open.figures} />
  ) : (
    <p class="chart-empty muted">Without a plan there is no line to be beside.</p>
  );
  if (shown === "histogram") return distribution;
  if (shown === "both") {
    return (
      <div class="stacked">
        <TimeChart kind="altitude" open={open} />
        <TimeChart kind="cross_track" open={open} />
      </div>
    );
  }
  return <TimeChart kind={shown} open={open} />;
}

/** Charts over time on one clock with the replay, which they also steer. */
export function TimePane() {
  const open = review.value;
  const fitsBoth = chartHeight_px.value >= BOTH_PX;
  const shown = tab.value === "both" && !fitsBoth ? "altitude" : tab.value;
  return (
    <section
      class="profile-pane time-pane"
      style={{ height: `${chartHeight_px.value}px` }}
      aria-label="Flight over time"
    >
      <ResizeHandle />
      <Transport />
      <header>
        <Segmented
          label="Chart"
          testid="time-chart"
          value={shown}
          options={[
            { value: "altitude", label: "Altitude" },
            { value: "cross_track", label: "Cross-track" },
            { value: "histogram", label: "Histogram" },
            ...(fitsBoth ? [{ value: "both" as const, label: "Both" }] : []),
          ]}
          onChange={(next) => (tab.value = next)}
        />
        {open && (shown === "altitude" || shown === "both") && <Keys open={open} />}
        <span class="spring" />
        {open && <Values open={open} shown={shown} />}
      </header>
      {open ? (
        <div class="plot-holder">
          <Charts open={open} shown={shown} />
        </div>
      ) : (
        <p class="chart-empty muted">
          {opening.value
            ? "Reading and judging the flight…"
            : "Altitude and cross-track error over time appear here. Choose a recording."}
        </p>
      )}
    </section>
  );
}
