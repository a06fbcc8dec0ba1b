import type uPlot from "uplot";
import { CHART_FONT, type Palette } from "./palette";
import { labelsThatFit, type LevelSpan, type Span } from "./transform";

/** What the charts draw themselves, in canvas pixels over uPlot's own curves. */

type Plot = uPlot;
type Context = CanvasRenderingContext2D;

const dpr = () => window.devicePixelRatio || 1;
const STRIP_PX = 6;

function clipped(u: Plot, draw: (ctx: Context) => void): void {
  const { ctx, bbox } = u;
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
  draw(ctx);
  ctx.restore();
}

const x = (u: Plot, s_m: number) => u.valToPos(s_m, "x", true);
const y = (u: Plot, value: number) => u.valToPos(value, "y", true);

/** Where nothing is known about the ground: hatched over the whole height. */
export function drawUnknown(u: Plot, spans: readonly Span[], palette: Palette): void {
  if (spans.length === 0) return;
  clipped(u, (ctx) => {
    ctx.strokeStyle = palette.unknown;
    ctx.lineWidth = dpr();
    const { top, height } = u.bbox;
    for (const [from_m, to_m] of spans) {
      const [left, right] = [x(u, from_m), x(u, to_m)];
      ctx.save();
      ctx.beginPath();
      ctx.rect(left, top, right - left, height);
      ctx.clip();
      ctx.beginPath();
      for (let at = left - height; at < right; at += 9 * dpr()) {
        ctx.moveTo(at, top + height);
        ctx.lineTo(at + height, top);
      }
      ctx.stroke();
      ctx.restore();
    }
  });
}

/** The clearance strip along the bottom: green solid, orange with a notch, red double height, unknown hatched. */
export function drawStrip(u: Plot, spans: readonly LevelSpan[], palette: Palette): void {
  clipped(u, (ctx) => {
    const bottom = u.bbox.top + u.bbox.height;
    for (const { from_m, to_m, level } of spans) {
      const height = (level === "bad" ? 2 : level === "near" ? 1.5 : 1) * STRIP_PX * dpr();
      const left = x(u, from_m);
      ctx.fillStyle = palette[level];
      ctx.fillRect(left, bottom - height, Math.max(2 * dpr(), x(u, to_m) - left), height);
    }
  });
}

/** The mission as it will be flown: straight lines between its waypoints. */
export function drawFlown(
  u: Plot,
  s_m: readonly number[],
  heights_m: readonly number[],
  palette: Palette,
): void {
  clipped(u, (ctx) => {
    ctx.strokeStyle = palette.accent;
    ctx.fillStyle = palette.panel;
    ctx.lineWidth = 1.25 * dpr();
    ctx.beginPath();
    s_m.forEach((s, index) => ctx.lineTo(x(u, s), y(u, heights_m[index] ?? 0)));
    ctx.stroke();
    ctx.lineWidth = 1.5 * dpr();
    s_m.forEach((s, index) => {
      ctx.beginPath();
      ctx.arc(x(u, s), y(u, heights_m[index] ?? 0), 2.75 * dpr(), 0, 2 * Math.PI);
      ctx.fill();
      ctx.stroke();
    });
  });
}

/** Points of interest: a dashed line each, and their names where they fit. */
export function drawPois(u: Plot, s_m: readonly number[], names: readonly string[], palette: Palette): void {
  const { ctx, bbox } = u;
  ctx.save();
  ctx.font = CHART_FONT.replace("14px", `${14 * dpr()}px`);
  ctx.textAlign = "center";
  ctx.textBaseline = "bottom";
  const texts = names.map((name) => (name.length > 16 ? `${name.slice(0, 15)}…` : name));
  const places = s_m.map((s) => x(u, s));
  const widths = texts.map((text) => ctx.measureText(text).width);
  const centred = places.map((place, index) => keptInside(u, place, (widths[index] ?? 0) / 2));
  const shown = labelsThatFit(centred, widths, 8 * dpr());
  ctx.strokeStyle = palette.muted;
  ctx.fillStyle = palette.text;
  ctx.lineWidth = dpr();
  ctx.setLineDash([2 * dpr(), 4 * dpr()]);
  places.forEach((place, index) => {
    if (place < bbox.left - 1 || place > bbox.left + bbox.width + 1) return;
    ctx.beginPath();
    ctx.moveTo(place, bbox.top);
    ctx.lineTo(place, bbox.top + bbox.height);
    ctx.stroke();
    if (shown[index]) ctx.fillText(texts[index] ?? "", centred[index] ?? place, bbox.top - 3 * dpr());
  });
  ctx.restore();
}

function keptInside(u: Plot, place: number, half: number): number {
  const right = u.bbox.left + u.bbox.width;
  return Math.min(right - half, Math.max(u.bbox.left + half, place));
}

/** The nearest place: a ring with a cross, whatever its colour. */
export function drawWorst(u: Plot, s_m: number, height: number, color: string): void {
  clipped(u, (ctx) => {
    const [px, py, r] = [x(u, s_m), y(u, height), 7 * dpr()];
    ctx.strokeStyle = color;
    ctx.lineWidth = 2.25 * dpr();
    ctx.beginPath();
    ctx.arc(px, py, r, 0, 2 * Math.PI);
    for (const [dx, dy] of [
      [0, 1],
      [0, -1],
      [1, 0],
      [-1, 0],
    ] as const) {
      ctx.moveTo(px + dx * r * 0.5, py + dy * r * 0.5);
      ctx.lineTo(px + dx * r * 1.7, py + dy * r * 1.7);
    }
    ctx.stroke();
  });
}

/** A horizontal line with words, such as the required clearance. */
export function drawLevel(u: Plot, value: number, text: string, palette: Palette): void {
  clipped(u, (ctx) => {
    const at = y(u, value);
    ctx.strokeStyle = palette.near;
    ctx.lineWidth = 1.5 * dpr();
    ctx.setLineDash([6 * dpr(), 4 * dpr()]);
    ctx.beginPath();
    ctx.moveTo(u.bbox.left, at);
    ctx.lineTo(u.bbox.left + u.bbox.width, at);
    ctx.stroke();
    ctx.fillStyle = palette.text;
    ctx.font = CHART_FONT.replace("14px", `${14 * dpr()}px`);
    ctx.textAlign = "right";
    ctx.fillText(text, u.bbox.left + u.bbox.width - 6 * dpr(), at - 5 * dpr());
  });
}
