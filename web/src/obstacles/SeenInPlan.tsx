import { Changes } from "../ui/Changes";
import { count } from "../format";
import { pending } from "../store/outcomes";
import { whyNotAsk } from "../store/reach";
import { document_, result } from "../store/state";
import { Button } from "../ui/Button";
import { Icon } from "../ui/Icon";
import { Outcome } from "../ui/Outcome";
import { SEEN, planWithSeen } from "./obstacle_orders";

/** In Plan: the surface model is not as it was read, and the way out of it. */
export function SeenInPlan() {
  if (document_.value?.seen_id == null) return null;
  const lacks = document_.value.seen_lacks;
  const columns = result.value?.seen_columns ?? 0;
  return (
    <div class="callout wrap-row seen-in-plan" data-testid="seen-in-plan">
      <Icon name="radar" />
      <p>
        {columns > 0
          ? `${count(columns, "seen column")} on the surface model`
          : "What was seen is on the surface model"}
        : path and certificate keep clear of it. What only the radar has seen may be higher than that.
        {lacks && <strong data-testid="seen-lacks"> Not all: {lacks}</strong>}
      </p>
      <Changes>
        <Button
          disabled={pending.value.has(SEEN) || whyNotAsk.value !== null}
          title={whyNotAsk.value ?? "Back to the surface model as it was read"}
          testid="take-seen-out"
          onClick={() => void planWithSeen(false)}
        >
          Take them out
        </Button>
      </Changes>
      <Outcome place={SEEN} />
    </div>
  );
}
