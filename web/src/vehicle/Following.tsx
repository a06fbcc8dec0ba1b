import { DASH, clearance, deviation, duration, metres, percent } from "../format";
import type { FollowDoc, VehicleState } from "../messages";
import type { Source } from "../store/flying";
import { obstacles } from "../store/obstacles";
import { result } from "../store/state";
import { Bar } from "../ui/Bar";
import { Icon } from "../ui/Icon";
import { REACH, againstFlown, followsPlan, markerShare, tolerance_m, verdictOf } from "./deviation";

interface ErrorProps {
  label: string;
  value_m: number | null;
  allowed_m: number;
  /** Off the line means something only while the plan is flown. */
  judged: boolean;
  words: { more: string; less: string };
  testid: string;
}

const NOTES = { within: "", beyond: "beyond tolerance", far: "far off", unknown: "" } as const;

/** A deviation to either side on a bar with its tolerance, and as a number. */
function SignedBar({ label, value_m, allowed_m, judged, words, testid }: ErrorProps) {
  const verdict = judged ? verdictOf(value_m, allowed_m) : "unknown";
  const band = 100 / REACH;
  return (
    <div class={`signed ${verdict}`} data-testid={testid} data-verdict={verdict}>
      <span class="signed-label">{label}</span>
      <span class="signed-value">
        {NOTES[verdict] && <Icon name="warning" size={16} />}
        {deviation(value_m, words)}
        {NOTES[verdict] && <span class="visually-hidden">, {NOTES[verdict]}</span>}
      </span>
      <span class="signed-bar" aria-hidden="true" title={`Tolerance ±${metres(allowed_m, 2)}`}>
        <span class="band" style={{ left: `${50 - band / 2}%`, width: `${band}%` }} />
        <span class="zero" />
        {value_m !== null && (
          <span class="marker" style={{ left: `${markerShare(value_m, allowed_m) * 100}%` }} />
        )}
      </span>
    </div>
  );
}

function behindWords(behind_s: number | null): string {
  if (behind_s === null) return DASH;
  const size = Math.round(Math.abs(behind_s));
  if (size < 1) return "on time";
  return `${duration(size)} ${behind_s > 0 ? "behind plan" : "ahead of plan"}`;
}

/** A smaller one is none to speak of. */
const LEAST_RAISED_M = 0.05;

interface Props {
  source: Source;
  state: VehicleState | null;
  follow: FollowDoc | null;
  isOld: boolean;
}

/** Loud, and there until the next flight: it flew nearer to the ground than was required. */
function Below({ follow }: { follow: FollowDoc | null }) {
  const least_m = follow?.least_distance_m ?? null;
  const required_m = follow?.required_distance_m ?? null;
  if (least_m === null || required_m === null || least_m >= required_m) return null;
  return (
    <p class="below-required" role="alert" data-testid="below-required">
      <Icon name="warning" size={20} />
      <span>
        <strong>Below the required clearance</strong> {clearance(least_m)} flown, {metres(required_m, 2)}{" "}
        required
      </span>
    </p>
  );
}

/** How well the plan is being followed, how far it is flown, and how long it will take. */
export function Following({ source, state, follow, isOld }: Props) {
  const flown = againstFlown(follow?.height_error_m ?? null, obstacles[source].value.avoidance);
  const judged = followsPlan(state) && flown.isOnLine;
  const allowed_m = tolerance_m(result.value?.tube?.radius_m);
  const progress = follow?.progress ?? null;
  return (
    <section class={`instrument following ${isOld ? "old" : ""}`} aria-label="Following the plan">
      <Below follow={follow} />
      <SignedBar
        label="Cross-track"
        value_m={follow?.cross_track_m ?? null}
        allowed_m={allowed_m}
        judged={judged}
        words={{ more: "right", less: "left" }}
        testid="cross-track"
      />
      <SignedBar
        label={flown.raised_m >= LEAST_RAISED_M ? `Height, plan +${metres(flown.raised_m)}` : "Height error"}
        value_m={flown.height_error_m}
        allowed_m={allowed_m}
        judged={judged}
        words={{ more: "high", less: "low" }}
        testid="height-error"
      />
      <div class="progress">
        <span class="progress-share" data-testid="progress">
          {percent(progress)}
        </span>
        <Bar label="Flown of the plan" share={progress ?? 0} />
        <span class="progress-left" data-testid="time-left">
          {follow?.time_left_s == null ? DASH : `${duration(follow.time_left_s)} left`}
        </span>
        <span class="muted progress-behind">{behindWords(follow?.behind_plan_s ?? null)}</span>
      </div>
    </section>
  );
}
