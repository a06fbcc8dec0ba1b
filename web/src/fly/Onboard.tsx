import { useSignal } from "@preact/signals";
import { clearance, count, demanded, metres, number, withUnit } from "../format";
import type { CheckRow, OnboardDoc, Rounded, TakenUpDoc } from "../messages";
import { adopted, fly, isInAir } from "../store/flying";
import { pending } from "../store/outcomes";
import { whyNotCommand, whyUnheard } from "../store/reach";
import { document_ } from "../store/state";
import { Button } from "../ui/Button";
import { Check } from "../ui/fields";
import { HoldButton } from "../ui/HoldButton";
import { Icon } from "../ui/Icon";
import { Section } from "../ui/Section";
import {
  NEXT,
  acceptOthers,
  areOthersAccepted,
  checkStart,
  takeUpPlan,
  uploadPlan,
  uploadRefusal,
} from "../vehicle/orders";
import { FenceHeights } from "./FenceHeights";

const SUMMARIES = { unknown: "not known", none: "none", verified: "verified" } as const;
const MOST_ROWS = 40;

function RoundedRows({ rounded }: { rounded: readonly Rounded[] }) {
  return (
    <details class="details">
      <summary>{count(rounded.length, "value")} in detail</summary>
      <table class="rounded">
        <thead>
          <tr>
            <th scope="col">Item</th>
            <th scope="col">Field</th>
            <th scope="col">Sent</th>
            <th scope="col">Kept</th>
          </tr>
        </thead>
        <tbody>
          {rounded.slice(0, MOST_ROWS).map((row) => (
            <tr key={`${row.item} ${row.field}`}>
              <td>{row.item}</td>
              <td>{row.field}</td>
              <td>{number(row.sent, 3)}</td>
              <td>{number(row.kept, 3)}</td>
            </tr>
          ))}
        </tbody>
      </table>
      {rounded.length > MOST_ROWS && <p class="hint">and {rounded.length - MOST_ROWS} more</p>}
    </details>
  );
}

function State({ onboard }: { onboard: OnboardDoc }) {
  if (onboard.state === "none") return <p class="hint">There is no mission on the vehicle.</p>;
  if (onboard.state === "unknown") {
    return (
      <p class="hint">What is on the vehicle has not been read. An upload replaces it, then reads it back.</p>
    );
  }
  const name = onboard.plan_name || "A mission from elsewhere";
  return (
    <div class="onboard verified">
      <Icon name="check" />
      <div>
        <strong data-testid="onboard-name">{name}</strong>
        <p class="muted">
          {count(onboard.items, "item")}, read back and verified
          {onboard.digest && <span title={onboard.digest}> · {onboard.digest.slice(0, 8)}</span>}
        </p>
      </div>
    </div>
  );
}

/** The open plan, from where the vehicle is: it is held first, and goes on when the operator presses Resume. */
function FromHere({ onboard }: { onboard: OnboardDoc }) {
  const acceptsBattery = useSignal(false);
  const taken = fly.value?.taken_up;
  if (taken) return <TakenUp taken={taken} />;
  if (!isInAir.value) return null;
  const isFlown = onboard.state === "verified" && onboard.is_open_plan;
  const why = whyNotCommand.value ?? uploadRefusal();
  return (
    <div class="callout wrap-row" data-testid="fly-from-here">
      <Icon name="route" />
      <p>
        The open plan ({document_.value?.name ?? "none"}) is {isFlown ? "on board" : "not what is on board"}.
      </p>
      <Check
        label="Battery reserve may be used"
        checked={acceptsBattery.value}
        testid="take-up-battery"
        onChange={(yes) => (acceptsBattery.value = yes)}
      />
      <HoldButton
        label={isFlown ? "Certify the rest from here" : "Fly the new plan from here"}
        icon="play"
        place={NEXT}
        disabled={why !== null || Boolean(fly.value?.busy)}
        title={why ?? "Holds; the way there and the rest are certified and sent; Resume flies them"}
        testid="take-up"
        onHold={() => void takeUpPlan(acceptsBattery.value)}
      />
    </div>
  );
}

function TakenUp({ taken }: { taken: TakenUpDoc }) {
  return (
    <div class="onboard verified" data-testid="taken-up">
      <Icon name="check" />
      <div>
        <strong>CERTIFIED from here</strong>
        <p>
          {metres(taken.way_m, 0)} to the plan, {withUnit(taken.seconds, "s")}; then item {taken.item} on.
          {taken.left_out > 0 && ` ${count(taken.left_out, "waypoint")} before it left out.`}
        </p>
        <p>
          Clear by {clearance(taken.clearance_m)}, required {demanded(taken.required_m)}.
        </p>
        {[...taken.notes, taken.battery.text].map((note) => (
          <p key={note} class="muted">
            {note}
          </p>
        ))}
        {taken.others && <Others row={taken.others} />}
      </div>
    </div>
  );
}

/** The station's other vehicles, as they would be met if it were resumed now. */
function Others({ row }: { row: CheckRow }) {
  return (
    <div data-testid="taken-up-others" data-state={row.state}>
      <p>
        {row.text} {row.mend}
      </p>
      {row.state === "accept" && (
        <Check
          label="I accept this"
          checked={areOthersAccepted()}
          disabled={whyNotCommand.value !== null}
          testid="taken-up-accept-others"
          onChange={acceptOthers}
        />
      )}
    </div>
  );
}

/** An older plan may be flown as well, after the same check; a mission from elsewhere may not. */
function NotThePlan({ onboard }: { onboard: OnboardDoc }) {
  if (isInAir.value || onboard.state !== "verified" || onboard.is_open_plan) return null;
  const busy = pending.value.has(NEXT) || whyNotCommand.value !== null;
  return (
    <div class="callout wrap-row" data-testid="not-the-plan">
      <Icon name="warning" />
      <p>This is not the plan that is open ({document_.value?.name ?? "none"}, as it is now).</p>
      <Button
        disabled={busy || uploadRefusal() !== null}
        testid="upload-open-plan"
        onClick={() => void uploadPlan(NEXT)}
      >
        Upload the open plan
      </Button>
      {onboard.plan_name !== "" && (
        <Button kind="quiet" disabled={busy} testid="check-onboard" onClick={() => void checkStart()}>
          Check what is on board
        </Button>
      )}
    </div>
  );
}

/** The mission on the vehicle, and what the vehicle made of it. */
export function OnboardSection() {
  const state = fly.value;
  if (!adopted.value || !state) return null;
  const { onboard } = state;
  return (
    <Section
      id="onboard"
      title="On board"
      icon="route"
      summary={
        whyUnheard.value
          ? "as last read"
          : onboard.is_open_plan
            ? "the open plan, verified"
            : SUMMARIES[onboard.state]
      }
      startsOpen
    >
      <State onboard={onboard} />
      <NotThePlan onboard={onboard} />
      <FromHere onboard={onboard} />
      <FenceHeights onboard={onboard} />
      {onboard.rounded_note && (
        <p class="hint" data-testid="rounded-note">
          {onboard.rounded_note}
        </p>
      )}
      {onboard.rounded.length > 0 && <RoundedRows rounded={onboard.rounded} />}
    </Section>
  );
}
