import { metres } from "../format";
import type { RadarTargetsDoc } from "../messages";
import type { Source } from "../store/flying";
import { axes, Drawn, line, type Pen } from "./Drawn";
import { px, targetsReach_m, ticks, type Frame } from "./looking";
import { usePolled } from "./polled";

const EVERY_MS = 500;

/** The gate from above: what lies within it is kept, if its elevation is. */
function drawGate(pen: Pen, frame: Frame, doc: RadarTargetsDoc): void {
  const { context, color } = pen;
  const half = (doc.azimuth_deg * Math.PI) / 180;
  context.strokeStyle = color("--text");
  context.lineWidth = 1.5;
  context.setLineDash([5, 4]);
  for (const side of [-1, 1]) {
    const tip: [number, number] = px(frame, 0, 0);
    const end = px(frame, side * Math.sin(half) * doc.farthest_m, Math.cos(half) * doc.farthest_m);
    line(context, tip, end);
  }
  for (const range_m of [doc.nearest_m, doc.farthest_m]) {
    context.beginPath();
    context.arc(frame.x0, frame.y0, range_m * frame.scale, -Math.PI / 2 - half, -Math.PI / 2 + half);
    context.stroke();
  }
  context.setLineDash([]);
}

/** Kept ones are full diamonds, the others hollow crosses: their colour is never all that tells them. */
function drawTargets(pen: Pen, frame: Frame, doc: RadarTargetsDoc): void {
  const { context, color } = pen;
  doc.right_m.forEach((right_m, n) => {
    const [x, y] = px(frame, right_m, doc.ahead_m[n] ?? 0);
    context.lineWidth = 1.5;
    if (doc.kept[n]) {
      context.fillStyle = color("--radar");
      context.strokeStyle = color("--instrument");
      context.beginPath();
      context.moveTo(x, y - 5);
      context.lineTo(x + 5, y);
      context.lineTo(x, y + 5);
      context.lineTo(x - 5, y);
      context.closePath();
      context.fill();
      context.stroke();
      return;
    }
    context.strokeStyle = color("--muted");
    line(context, [x - 4, y - 4], [x + 4, y + 4]);
    line(context, [x - 4, y + 4], [x + 4, y - 4]);
  });
}

function drawAll(pen: Pen, doc: RadarTargetsDoc): void {
  const { width, height } = pen;
  const reach_m = targetsReach_m(doc);
  const frame: Frame = { scale: (height - 24) / reach_m, x0: width / 2, y0: height - 14 };
  const half_m = width / 2 / frame.scale;
  axes(
    pen,
    ticks(-half_m, half_m, frame.scale, 44).map((value) => [px(frame, value, 0)[0], value]),
    ticks(0, reach_m, frame.scale, 36).map((value) => [px(frame, 0, value)[1], value]),
  );
  drawGate(pen, frame, doc);
  drawTargets(pen, frame, doc);
}

function words(doc: RadarTargetsDoc | null): string {
  if (!doc || doc.t_mono_s === null) return "The radar has sent no frame yet.";
  const kept = doc.kept.filter(Boolean).length;
  const gate = `±${Math.round(doc.azimuth_deg)}°, ${Math.round(doc.low_deg)} to ${Math.round(doc.high_deg)}° up`;
  return `${kept} of ${doc.kept.length} kept; gate ${gate}, ${metres(doc.nearest_m)} to ${metres(doc.farthest_m, 0)}`;
}

/** All targets of the radar's newest frame in its own frame, x right, y ahead (Miccinesi 2022, fig. 12). */
export function TargetsPanel({ source }: { source: Source }) {
  const { value, error } = usePolled<RadarTargetsDoc>(`/api/obstacles/targets?source=${source}`, EVERY_MS);
  return (
    <div class="looking">
      <Drawn
        label={`Radar targets from above, nose up: ${words(value)}`}
        testid={`targets-${source}`}
        count={value?.kept.length ?? 0}
        draw={(pen) => value && value.t_mono_s !== null && drawAll(pen, value)}
      />
      <p class="looking-says muted" data-testid={`targets-says-${source}`}>
        {error?.what ?? words(value)}
      </p>
      <ul class="looking-keys" aria-hidden="true">
        <li class="target-kept">◆ kept</li>
        <li class="muted">× outside the gate</li>
      </ul>
    </div>
  );
}
