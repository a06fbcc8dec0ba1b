import type { SensorName } from "../store/obstacles";

/** Around (0, 0): each sensor has a shape of its own, so that its hue is never all that tells it. */
export const SHAPES: Record<SensorName, string> = {
  radar: "M0-6.5 6.5 0 0 6.5-6.5 0z",
  vision: "M-5-5H5V5H-5z",
  ranges: "M0 5.5a5.5 5.5 0 1 1 0-11 5.5 5.5 0 0 1 0 11z",
};

export function SensorMark({ sensor }: { sensor: SensorName }) {
  return (
    <svg
      class={`sensor-mark sensor-${sensor}`}
      viewBox="-8 -8 16 16"
      width="16"
      height="16"
      aria-hidden="true"
    >
      <path d={SHAPES[sensor]} />
    </svg>
  );
}
