import { useEffect, useRef } from "preact/hooks";
import type uPlot from "uplot";
import { metres } from "../format";
import { heard, tracks, trackVersion } from "../store/flying";
import { theme } from "../store/prefs";
import { isOld } from "../store/reach";
import { aheadOf } from "../obstacles/ahead";
import { conflictWhere } from "../obstacles/obstacle_words";
import { watching } from "../store/obstacles";
import { Icon } from "../ui/Icon";
import { VerticalLine } from "./ChartBox";

const REDRAW_MS = 200;

/** Where along the path the mission ahead meets what was seen. */
function ConflictMark({ plot }: { plot: uPlot }) {
  const s_m = heard.live.value?.message.follow?.s_m;
  const { conflict } = aheadOf(watching("live"));
  if (s_m == null || !conflict) return null;
  const at = s_m + conflict.ahead_m;
  const x = plot.valToPos(at, "x");
  if (x < 0 || x > plot.over.clientWidth) return null;
  const style = { left: `${plot.over.offsetLeft + x}px`, top: `${plot.over.offsetTop}px` };
  return (
    <>
      <VerticalLine plot={plot} at={at} kind="conflict-line" testid="conflict-line" />
      <span class="conflict-mark" style={style} title={`Conflict ${conflictWhere(conflict)}`}>
        <Icon name="warning" size={16} />
      </span>
    </>
  );
}

/** The flown path on a canvas of its own: the chart below is not drawn again for each new place. */
function draw(canvas: HTMLCanvasElement, plot: uPlot): void {
  const { clientWidth: width, clientHeight: height } = plot.over;
  const scale = window.devicePixelRatio || 1;
  canvas.width = width * scale;
  canvas.height = height * scale;
  const ctx = canvas.getContext("2d");
  if (!ctx) return;
  ctx.scale(scale, scale);
  ctx.strokeStyle = getComputedStyle(document.documentElement).getPropertyValue("--flown").trim();
  ctx.lineWidth = 2.5;
  ctx.lineJoin = "round";
  ctx.beginPath();
  const { s_m, alt_rel_home_m } = tracks.live;
  let isDown = false;
  for (let index = 0; index < s_m.length; index++) {
    const [s, alt] = [s_m[index], alt_rel_home_m[index]];
    if (s == null || alt == null) {
      isDown = false;
      continue;
    }
    const [x, y] = [plot.valToPos(s, "x"), plot.valToPos(alt, "y")];
    if (isDown) ctx.lineTo(x, y);
    else ctx.moveTo(x, y);
    isDown = true;
  }
  ctx.stroke();
}

function Marker({ plot }: { plot: uPlot }) {
  const from = heard.live.value;
  const follow = from?.message.follow;
  if (follow?.s_m == null || follow.alt_rel_home_m === null) return null;
  const x = plot.valToPos(follow.s_m, "x");
  const y = plot.valToPos(follow.alt_rel_home_m, "y");
  const { clientWidth, clientHeight } = plot.over;
  if (x < -1 || x > clientWidth + 1) return null;
  const style = {
    left: `${plot.over.offsetLeft + x}px`,
    top: `${plot.over.offsetTop + Math.min(clientHeight, Math.max(0, y))}px`,
  };
  return (
    <span
      class={`vehicle-marker ${isOld("live", "position") ? "old" : ""}`}
      style={style}
      title={`Vehicle, ${metres(follow.alt_rel_home_m)} above home`}
      data-testid="vehicle-marker"
    />
  );
}

/** The flown path and the vehicle over the altitude chart. */
export function FlownLayer({ plot }: { plot: uPlot }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  useEffect(() => {
    let drawn: unknown = null;
    const redraw = () => {
      const now = `${trackVersion.live.value} ${theme.value}`;
      if (now === drawn || !canvas.current) return;
      drawn = now;
      draw(canvas.current, plot);
    };
    redraw();
    const timer = setInterval(redraw, REDRAW_MS);
    return () => clearInterval(timer);
  }, [plot]);
  const { offsetLeft, offsetTop, clientWidth, clientHeight } = plot.over;
  const style = {
    left: `${offsetLeft}px`,
    top: `${offsetTop}px`,
    width: `${clientWidth}px`,
    height: `${clientHeight}px`,
  };
  return (
    <>
      <canvas class="flown-layer" ref={canvas} style={style} data-testid="flown-layer" aria-hidden="true" />
      <ConflictMark plot={plot} />
      <Marker plot={plot} />
    </>
  );
}
