import { holdCamera, send } from "../store/stream";
import { dragging } from "../store/view";
import { carriesFiles } from "../ui/choose_files";
import { throttled } from "../ui/throttle";

const HOVER_PERIOD_MS = 1000 / 15;

const hover = throttled<{ x: number; y: number } | null>(HOVER_PERIOD_MS, (at) => {
  send({ type: "hover_view", x: at?.x ?? null, y: at?.y ?? null });
});

const share = (value: number, whole: number) => Math.min(1, Math.max(0, value / whole));

/** A wheel has no end: this long after its last turn the hand is off it. */
const WHEEL_MS = 400;

/** What follows a vehicle waits while the operator turns, moves or zooms. */
function watchHand(inside: Window): void {
  let wheel: ReturnType<typeof setTimeout> | undefined;
  inside.addEventListener("pointerdown", () => holdCamera(true), true);
  for (const kind of ["pointerup", "pointercancel"])
    inside.addEventListener(kind, () => holdCamera(false), true);
  inside.addEventListener(
    "wheel",
    () => {
      if (wheel === undefined) holdCamera(true);
      clearTimeout(wheel);
      wheel = setTimeout(() => {
        wheel = undefined;
        holdCamera(false);
      }, WHEEL_MS);
    },
    { capture: true, passive: true },
  );
}

/** The 3D view is a page of its own within ours: its pointer, keys and dragged files are passed on to us. */
export function listenInside(frame: HTMLIFrameElement, onKey: (event: KeyboardEvent) => void): void {
  const inside = frame.contentWindow;
  if (!inside) return;
  const { document } = inside;
  document.addEventListener("pointermove", (event) =>
    hover({ x: share(event.clientX, inside.innerWidth), y: share(event.clientY, inside.innerHeight) }),
  );
  document.documentElement.addEventListener("pointerleave", () => hover(null));
  document.addEventListener("keydown", onKey);
  watchHand(inside);
  document.addEventListener("dragenter", (event) => {
    if (!carriesFiles(event)) return;
    event.preventDefault();
    dragging.value = true;
  });
}
