import { count, number } from "../format";
import type { OnboardDoc, Rounded } from "../messages";
import { adopted, fly, isInAir } from "../store/flying";
import { pending } from "../store/outcomes";
import { whyNotCommand, whyUnheard } from "../store/reach";
import { document_ } from "../store/state";
import { Button } from "../ui/Button";
import { Icon } from "../ui/Icon";
import { Section } from "../ui/Section";
import { NEXT, checkStart, uploadPlan, uploadRefusal } from "../vehicle/orders";

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

/** An older plan may be flown as well, after the same check; a mission from elsewhere may not. */
function NotThePlan({ onboard }: { onboard: OnboardDoc }) {
  if (onboard.state !== "verified" || onboard.is_open_plan) return null;
  const busy = pending.value.has(NEXT) || whyNotCommand.value !== null || isInAir.value;
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
      {onboard.rounded_note && (
        <p class="hint" data-testid="rounded-note">
          {onboard.rounded_note}
        </p>
      )}
      {onboard.rounded.length > 0 && <RoundedRows rounded={onboard.rounded} />}
    </Section>
  );
}
