import { clock, metres } from "../format";
import type { CheckRow, FlyState, PreflightDoc } from "../messages";
import { adopted, fly, isInAir } from "../store/flying";
import { pending } from "../store/outcomes";
import { whyNotCommand, whyUnheard } from "../store/reach";
import { Button, Segmented } from "../ui/Button";
import { Icon, type IconName } from "../ui/Icon";
import { Section } from "../ui/Section";
import { Check } from "../ui/fields";
import {
  NEXT,
  accept,
  accepted,
  checkStart,
  isAcceptable,
  resumeFrom,
  resumes,
  way,
  wayToFly,
} from "../vehicle/orders";
import { checklistObstacle } from "../store/checklist";
import { Checklist } from "./Checklist";
import { ROW_TITLES, openChecks, unaccepted } from "./next_step";

const MARKS: Record<CheckRow["state"], { icon: IconName; word: string }> = {
  good: { icon: "check", word: "Good" },
  accept: { icon: "warning", word: "Accept?" },
  bad: { icon: "cross", word: "Not so" },
  unknown: { icon: "question", word: "Unknown" },
};

function Row({ row }: { row: CheckRow }) {
  // What was good then may no longer be.
  const state = whyUnheard.value ? "unknown" : row.state;
  const { icon, word } = MARKS[state];
  const isAccepted = isAcceptable(row.code) && accepted.value.has(row.code);
  return (
    <li class={`check-row ${state}`} data-testid="check-row" data-code={row.code} data-state={state}>
      <Icon name={icon} />
      <div>
        <p class="check-head">
          <strong>{ROW_TITLES[row.code]}</strong>
          <span class="check-word">{state === "accept" && isAccepted ? "Accepted" : word}</span>
        </p>
        <p>{row.text}</p>
        {row.mend && <p class="mend">{row.mend}</p>}
        {row.state === "accept" && isAcceptable(row.code) && (
          <Check
            label={row.code === "avoidance" ? "I fly without it, or slowed" : "I accept this"}
            checked={isAccepted}
            disabled={whyNotCommand.value !== null}
            testid={`accept-${row.code}`}
            onChange={(yes) => isAcceptable(row.code) && accept(row.code, yes)}
          />
        )}
      </div>
    </li>
  );
}

function summaryOf({ preflight, checklist }: FlyState): string {
  if (!preflight) return "not checked yet";
  if (openChecks(preflight.rows).length > 0) return "not ready";
  if (unaccepted(preflight.rows, accepted.value).length > 0) return "to be accepted";
  return checklistObstacle(checklist) === null ? "ready" : "to be ticked";
}

/** The next action asks to mend, or to tick, what stands here. */
const needsAttention = ({ preflight, checklist }: FlyState) =>
  preflight !== null &&
  (openChecks(preflight.rows).length > 0 ||
    unaccepted(preflight.rows, accepted.value).length > 0 ||
    checklistObstacle(checklist) !== null);

function Shift({ preflight }: { preflight: PreflightDoc }) {
  if (!preflight.rereferenced || preflight.home_shift_m === null) return null;
  return (
    <p class="callout" data-testid="rereferenced">
      <Icon name="info" />
      <span>
        Home lies {metres(Math.abs(preflight.home_shift_m), 2)}{" "}
        {preflight.home_shift_m > 0 ? "higher" : "lower"} than planned. All heights were moved by that,
        certified and uploaded again.
      </span>
    </p>
  );
}

/** After a battery swap: on from where it broke off, or all anew. */
function ResumeChoice() {
  const from = fly.value?.resume_from_item;
  if (!from) return null;
  return (
    <div class="labelled" data-testid="resume-choice">
      <span>The last flight broke off before item {from}.</span>
      <Segmented
        label="Where to start"
        testid="resume"
        value={resumes.value ? "resume" : "anew"}
        options={[
          { value: "resume", label: `At item ${from}` },
          { value: "anew", label: "From the beginning" },
        ]}
        onChange={(choice) => (resumes.value = choice === "resume")}
      />
    </div>
  );
}

/** What must be true before the start, one row each, and how it will be flown. */
export function PreflightSection() {
  const state = fly.value;
  if (!adopted.value || !state || state.onboard.state !== "verified") return null;
  const { preflight } = state;
  const goesOn = resumeFrom.value !== null;
  return (
    <Section
      id="preflight"
      title="Before the start"
      icon="check"
      summary={whyUnheard.value ? "not known now" : isInAir.value ? "in the air" : summaryOf(state)}
      startsOpen={!isInAir.value}
      isUrgent={!isInAir.value && needsAttention(state)}
    >
      {preflight ? (
        <>
          <Shift preflight={preflight} />
          <ul class="check-rows">
            {preflight.rows.map((row) => (
              <Row key={row.code} row={row} />
            ))}
          </ul>
          <div class="row">
            <span class="muted">
              {preflight.checked_utc &&
                `${whyUnheard.value ? "Known only as of" : "Checked at"} ${clock(preflight.checked_utc)}`}
            </span>
            <span class="spring" />
            <Button
              testid="check-again"
              disabled={whyNotCommand.value !== null || isInAir.value || pending.value.has(NEXT)}
              onClick={() => void checkStart()}
            >
              Check again
            </Button>
          </div>
        </>
      ) : (
        <p class="hint">
          The check judges what was read back from the vehicle, where the vehicle stands: clearance, home,
          return height, GNSS, battery.
        </p>
      )}
      {preflight && <Checklist />}
      <ResumeChoice />
      <div class="inline-choice">
        <span>Way</span>
        <Segmented
          label="Way of flying"
          testid="way"
          value={wayToFly.value}
          options={[
            {
              value: "auto",
              label: "AUTO",
              title: whyNotCommand.value ?? "The autopilot flies the mission on board",
              disabled: whyNotCommand.value !== null,
            },
            {
              value: "guided",
              label: "GUIDED",
              title:
                whyNotCommand.value ??
                (goesOn
                  ? "A flight that broke off goes on in AUTO"
                  : "Hedgehop hands over one waypoint at a time"),
              disabled: goesOn || whyNotCommand.value !== null,
            },
          ]}
          onChange={(next) => (way.value = next)}
        />
      </div>
    </Section>
  );
}
