interface Props {
  label: string;
  /** Share of the whole, 0 to 1; more than 1 is shown as full and over. */
  share: number | null;
  level?: "neutral" | "good" | "near" | "bad";
  /** A mark on the bar, 0 to 1. */
  mark?: number;
}

/** A horizontal bar that also says its share to screen readers. */
export function Bar({ label, share, level = "neutral", mark }: Props) {
  const shown = Math.min(1, Math.max(0, share ?? 0));
  return (
    <div
      class={`bar ${level} ${share === null ? "unknown" : ""}`}
      role="meter"
      aria-label={label}
      aria-valuemin={0}
      aria-valuemax={100}
      aria-valuenow={Math.round(shown * 100)}
    >
      <span class="bar-fill" style={{ width: `${shown * 100}%` }} />
      {mark !== undefined && <span class="bar-mark" style={{ left: `${mark * 100}%` }} />}
    </div>
  );
}
