import { signal } from "@preact/signals";
import type { PoiDoc } from "../../messages";
import { edit } from "../../store/plan";
import { withPoiAt } from "../../store/poi";

/** Which row is dragged and which it would land on. */
export const drag = signal<{ id: string; from: number; over: number } | null>(null);

export function movePoi(poi: PoiDoc, from: number, to: number): void {
  if (from !== to) edit(`Move point ${from + 1} to ${to + 1}`, "points", withPoiAt(poi.id, to));
}

/** The row under the pointer, which is captured by the handle meanwhile. */
function rowAt(event: PointerEvent): number | null {
  const row = document.elementFromPoint(event.clientX, event.clientY)?.closest<HTMLElement>("[data-index]");
  return row ? Number(row.dataset["index"]) : null;
}

/** Drags with mouse, pen or finger. */
export function startDrag(event: PointerEvent, poi: PoiDoc, from: number): void {
  const handle = event.currentTarget as HTMLElement;
  handle.setPointerCapture(event.pointerId);
  handle.onpointermove = (moveEvent) => {
    const over = rowAt(moveEvent);
    if (over !== null && (drag.value || over !== from)) drag.value = { id: poi.id, from, over };
  };
  const end = () => {
    handle.onpointermove = handle.onpointerup = handle.onpointercancel = null;
    drag.value = null;
  };
  handle.onpointercancel = end;
  handle.onpointerup = () => {
    const landing = drag.value;
    end();
    if (landing) movePoi(poi, from, landing.over);
  };
}

/** Where a dragged row would land: above the rows it moves up over, below those it moves down over. */
export function dropClass(index: number): string {
  const now = drag.value;
  if (!now || now.over !== index || now.from === index) return "";
  return now.from < index ? "drop-below" : "drop-above";
}
