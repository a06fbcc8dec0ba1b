import { useState } from "preact/hooks";
import { metres } from "../format";
import { LIMITS, type SectionDoc } from "../messages";
import type { Source } from "../store/flying";
import type { MapName } from "../store/obstacles";
import { Segmented } from "../ui/Button";
import { NumberFields } from "../ui/NumberField";
import { axes, Drawn, type Pen } from "./Drawn";
import { px, sectionFrame, ticks, type Frame } from "./looking";
import { usePolled } from "./polled";

const EVERY_MS = 1000;
const HUES: Record<MapName, string> = {
  radar: "--radar",
  vision: "--vision",
  ranges: "--vision",
  vision_flight: "--vision",
};
/** What the camera has seen on its way lies under what it sees now, and is fainter. */
const ORDER: readonly MapName[] = ["vision_flight", "vision", "ranges", "radar"];

function drawMaps(pen: Pen, frame: Frame, doc: SectionDoc): void {
  const { context, color } = pen;
  for (const name of ORDER) {
    const map = doc.maps.find((entry) => entry.name === name);
    if (!map) continue;
    const edge = Math.max(2, map.resolution_m * frame.scale * 0.92);
    map.s_m.forEach((s_m, n) => {
      const [x, y] = px(frame, s_m, map.up_m[n] ?? 0);
      const isGround = map.known_ground[n];
      context.globalAlpha = isGround ? 0.35 : name === "vision_flight" ? 0.55 : 1;
      context.fillStyle = isGround ? color("--muted") : color(HUES[name]);
      context.fillRect(x - edge / 2, y - edge / 2, edge, edge);
    });
    context.globalAlpha = 1;
  }
}

function drawGround(pen: Pen, frame: Frame, doc: SectionDoc): void {
  const { context, color } = pen;
  context.strokeStyle = color("--chart-ground-line");
  context.lineWidth = 2;
  context.beginPath();
  let isOpen = false;
  doc.ground_s_m.forEach((s_m, n) => {
    const up_m = doc.ground_up_m[n];
    if (up_m === null || up_m === undefined) {
      isOpen = false;
      return;
    }
    const [x, y] = px(frame, s_m, up_m);
    if (isOpen) context.lineTo(x, y);
    else context.moveTo(x, y);
    isOpen = true;
  });
  context.stroke();
}

function drawVehicle(pen: Pen, frame: Frame, doc: SectionDoc): void {
  if (doc.vehicle_up_m === null) return;
  const { context, color } = pen;
  const [x, y] = px(frame, 0, doc.vehicle_up_m);
  context.fillStyle = color("--text");
  context.strokeStyle = color("--instrument");
  context.lineWidth = 1.5;
  context.beginPath();
  if (doc.across) context.arc(x, y, 6, 0, 2 * Math.PI);
  else {
    context.moveTo(x + 10, y);
    context.lineTo(x - 8, y - 6);
    context.lineTo(x - 8, y + 6);
    context.closePath();
  }
  context.fill();
  context.stroke();
}

function drawSection(pen: Pen, doc: SectionDoc): void {
  const { width, height } = pen;
  const frame = sectionFrame(doc, width, height);
  const low_m = (frame.y0 - height) / frame.scale;
  const xs = ticks(-doc.reach_m, doc.reach_m, frame.scale, 50);
  const ys = ticks(low_m, low_m + height / frame.scale, frame.scale, 36);
  axes(
    pen,
    xs.map((value) => [px(frame, value, 0)[0], value]),
    ys.map((value) => [px(frame, 0, value)[1], value]),
  );
  drawGround(pen, frame, doc);
  drawMaps(pen, frame, doc);
  drawVehicle(pen, frame, doc);
}

const { thickness_m: THICKNESS, reach_m: REACH } = LIMITS.SectionAsked;
const EMPTY = { across: false, thickness_m: THICKNESS.initial as number, reach_m: REACH.initial as number };
const SIZES = [
  { key: "thickness_m", label: "Thickness", unit: "m", step: 0.5 },
  { key: "reach_m", label: "To both sides", unit: "m", step: 10 },
] as const;

const cellsOf = (doc: SectionDoc | null) =>
  doc?.maps.reduce((sum, map) => sum + map.known_ground.filter((known) => !known).length, 0) ?? 0;

/** A vertical slice through the maps at the vehicle, along or across its nose (Miccinesi 2022, figs 14 and 18). */
export function SectionPanel({ source }: { source: Source }) {
  const [wanted, setWanted] = useState(EMPTY);
  const { across, thickness_m, reach_m } = wanted;
  const query = `source=${source}&across=${across}&thickness_m=${thickness_m}&reach_m=${reach_m}`;
  const { value, error } = usePolled<SectionDoc>(`/api/obstacles/section?${query}`, EVERY_MS);
  const says = error?.what ?? value?.text ?? "";
  const axis = across ? "left ← metres → right" : "behind ← metres → ahead";
  return (
    <div class="looking">
      <div class="row">
        <Segmented
          label="Slice"
          testid="section"
          value={across ? "across" : "along"}
          options={[
            { value: "along", label: "Along" },
            { value: "across", label: "Across" },
          ]}
          onChange={(next) => setWanted({ ...wanted, across: next === "across" })}
        />
      </div>
      <div class="field-grid">
        <NumberFields
          fields={SIZES}
          limits={LIMITS.SectionAsked}
          values={wanted}
          group="section"
          onChange={(key, value) => setWanted({ ...wanted, [key]: value })}
        />
      </div>
      <Drawn
        label={`Slice ${across ? "across" : "along"} the heading, ${metres(thickness_m)} thick`}
        testid={`section-${source}`}
        count={cellsOf(value)}
        draw={(pen) => value && value.vehicle_up_m !== null && drawSection(pen, value)}
      />
      <p class="looking-says muted" data-testid={`section-says-${source}`}>
        {says || `${axis}; heights above home`}
      </p>
      <ul class="looking-keys" aria-hidden="true">
        <li>
          <span class="swatch cell-radar" /> Radar
        </li>
        <li>
          <span class="swatch cell-vision" /> Camera
        </li>
        <li>
          <span class="swatch explained" /> Known ground
        </li>
        <li>
          <span class="swatch ground-line" /> Model
        </li>
      </ul>
    </div>
  );
}
