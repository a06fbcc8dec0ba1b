import type { UwbLiveDoc } from "../messages";
import { pending } from "../store/outcomes";
import { Button } from "../ui/Button";
import { Icon } from "../ui/Icon";
import { Outcome } from "../ui/Outcome";
import { LIVE_RADAR, fuseLive } from "./ground_orders";
import { leftOut, liveWords } from "./ground_words";

/** A radar that scans now: how it does, what became of its scans, and by which rule. Its silence is said loudly. */
export function LiveRadar({ live, hasTerrain }: { live: UwbLiveDoc; hasTerrain: boolean }) {
  if (live.state === "none") return null;
  const isSilent = live.state === "silent";
  const missing = hasTerrain ? "" : "Choose a terrain: its map is what the scans clear.";
  const notes = [live.problem, missing, ...leftOut(live)].filter((note) => note !== "");
  return (
    <div class="live-radar" data-testid="live-radar" data-state={live.state}>
      <p class={isSilent ? "callout" : ""} role={isSilent ? "alert" : "status"}>
        <Icon name={isSilent ? "warning" : "radar"} size={16} />
        <span>{liveWords(live)}</span>
      </p>
      {notes.map((note) => (
        <p class="hint" key={note}>
          {note}
        </p>
      ))}
      <p class="hint">{live.rule}</p>
      <Button
        disabled={pending.value.has(LIVE_RADAR)}
        title="All scans so far are fused anew, by the rule and the numbers above"
        testid="fuse-live"
        onClick={() => void fuseLive()}
      >
        Fuse live scans so
      </Button>
      <Outcome place={LIVE_RADAR} />
    </div>
  );
}
