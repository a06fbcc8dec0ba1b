import { chartHeight_px } from "../store/prefs";

const LEAST_PX = 140;
const STEP_PX = 24;

function setHeight(height_px: number): void {
  const most_px = Math.max(LEAST_PX, window.innerHeight - 260);
  chartHeight_px.value = Math.round(Math.min(most_px, Math.max(LEAST_PX, height_px)));
}

/** Drags the border between 3D view and profile; the arrow keys move it too. */
export function ResizeHandle() {
  const onPointerDown = (event: PointerEvent) => {
    const handle = event.currentTarget as HTMLElement;
    const [startY, startHeight_px] = [event.clientY, chartHeight_px.value];
    handle.setPointerCapture(event.pointerId);
    handle.onpointermove = (move) => setHeight(startHeight_px + startY - move.clientY);
    handle.onpointerup = handle.onpointercancel = () => (handle.onpointermove = null);
  };
  const onKeyDown = (event: KeyboardEvent) => {
    if (event.key !== "ArrowUp" && event.key !== "ArrowDown") return;
    event.preventDefault();
    setHeight(chartHeight_px.value + (event.key === "ArrowUp" ? STEP_PX : -STEP_PX));
  };
  return (
    <div
      class="resize-handle"
      role="separator"
      tabIndex={0}
      aria-orientation="horizontal"
      aria-label="Height of the profile"
      aria-valuenow={chartHeight_px.value}
      data-testid="profile-resize"
      onPointerDown={onPointerDown}
      onKeyDown={onKeyDown}
    />
  );
}
