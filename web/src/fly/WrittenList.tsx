import type { WrittenDoc } from "../messages";
import { Icon } from "../ui/Icon";

const OUTCOMES: Record<WrittenDoc["outcome"], string> = {
  set: "set, read back",
  same: "was so already",
  adjusted: "NOT AS ASKED",
  kept: "NOT SET",
  refused: "NOT SET",
  unknown: "UNKNOWN",
  "not sent": "NOT SENT",
};

/** What became of parameters that were written, one row each. */
export function WrittenList({ written, testid }: { written: readonly WrittenDoc[]; testid: string }) {
  if (written.length === 0) return null;
  return (
    <ul class="written" role="status" data-testid={testid}>
      {written.map((one) => (
        <li key={`${one.name} ${one.asked}`} class={one.took ? "took" : "missed"} data-outcome={one.outcome}>
          <Icon name={one.took ? "check" : "warning"} size={16} />
          <span>
            <strong>{one.name}</strong> {one.before ?? "?"} → {one.asked}: {OUTCOMES[one.outcome]}
            {!one.took && one.after !== null && <>, the vehicle holds {one.after}</>}. {one.words}
          </span>
        </li>
      ))}
    </ul>
  );
}
