import { count } from "../format";
import { transfer } from "../store/flying";
import { whyUnheard } from "../store/reach";
import { Bar } from "../ui/Bar";

const PHASES = { sending: "Sending", reading_back: "Reading back", done: "Done", failed: "Failed" } as const;

/** A mission on its way, in items. */
export function TransferBar() {
  const now = transfer.value;
  if (!now || now.phase === "done" || now.phase === "failed" || whyUnheard.value !== null) return null;
  return (
    <div class="transfer" data-testid="transfer" role="status">
      <span>
        {PHASES[now.phase]} <span class="number">{`${now.done} of ${count(now.total, "item")}`}</span>
      </span>
      <Bar label={PHASES[now.phase]} share={now.total > 0 ? now.done / now.total : null} />
    </div>
  );
}
