import { latLon, metres, number } from "../format";
import { CopyPlace } from "../ui/CopyPlace";
import { isInAir, type Source } from "../store/flying";
import { goTo } from "../store/view";
import { hasSensors, watching } from "../store/obstacles";
import { pending } from "../store/outcomes";
import { whyNotAsk, whyUnheard } from "../store/reach";
import { document_ } from "../store/state";
import { Button } from "../ui/Button";
import { Icon } from "../ui/Icon";
import { Outcome } from "../ui/Outcome";
import { SensorMark } from "./SensorMark";
import { aheadOf, type Ahead } from "./ahead";
import { SEEN, planWithSeen, type SeenPart } from "./obstacle_orders";
import { SENSOR_WORDS, conflictWhere } from "./obstacle_words";

function ConflictLine({ conflict }: { conflict: NonNullable<Ahead["conflict"]> }) {
  return (
    <div class="conflict" data-testid="conflict">
      <Icon name="warning" />
      <div>
        <p>
          <strong>Conflict</strong> {conflictWhere(conflict)}
        </p>
        <p>
          <SensorMark sensor={conflict.sensor} /> {SENSOR_WORDS[conflict.sensor]}, {number(conflict.voxels)}{" "}
          voxels, {metres(conflict.distance_m)} from the line
          {conflict.top_unseen && "; its top is not seen"}
        </p>
        <p class="row place">
          <span class="muted number">{latLon(conflict)}</span>
          <CopyPlace place={conflict} name="the conflict" />
        </p>
      </div>
    </div>
  );
}

function Clear({ ahead, watches }: { ahead: Ahead; watches: boolean }) {
  if (whyUnheard.value !== null) return <p class="muted">Not known now. {whyUnheard.value}.</p>;
  if (!watches) return <p class="muted">Not watched: no sensor sees anything now.</p>;
  if (ahead.corridor_m <= 0) return <p class="muted">There is no mission ahead to look along.</p>;
  return (
    <p data-testid="ahead-clear">
      <Icon name="check" size={16} /> No conflict with what was seen.{" "}
      <span class="muted">Looks {metres(ahead.corridor_m, 0)} along it.</span>
    </p>
  );
}

const PARTS: readonly { part: SeenPart; label: string; title: string }[] = [
  {
    part: "ahead",
    label: "Mission ahead",
    title: "The points that are left, from where the vehicle is now: it replaces the points of the open plan",
  },
  {
    part: "home",
    label: "Way home",
    title: "From where the vehicle is now to where it took off: it replaces the points of the open plan",
  },
];

/** Takes the maps into planning: what was seen becomes columns on the surface model. */
function PlanAgainstSeen() {
  const isIn = document_.value?.seen_id != null;
  const lacks = document_.value?.seen_lacks;
  const isBusy = pending.value.has(SEEN);
  const cannot = whyNotAsk.value;
  return (
    <>
      <Button
        class="wide tall"
        icon="route"
        disabled={isBusy || cannot !== null}
        title={cannot ?? "What was seen becomes columns on the surface model of the open plan"}
        testid="plan-with-seen"
        onClick={() => void planWithSeen(true)}
      >
        {isBusy ? "Planning…" : isIn ? "Plan again with what was seen" : "Plan against what was seen"}
      </Button>
      <div class="row parts">
        {PARTS.map(({ part, label, title }) => (
          <Button
            key={part}
            disabled={isBusy || cannot !== null || !isInAir.value}
            title={cannot ?? (isInAir.value ? title : "No mission is being flown")}
            testid={`plan-with-seen-${part}`}
            onClick={() => void planWithSeen(true, part)}
          >
            {label}
          </Button>
        ))}
      </div>
      {isIn && (
        <p class="seen-columns" data-testid="seen-columns">
          What was seen is in the plan.{lacks ? ` Not all: ${lacks} ` : " "}
          <button type="button" class="link" data-testid="seen-to-plan" onClick={() => goTo("plan")}>
            Look at it in Plan
          </button>
        </p>
      )}
      <Outcome place={SEEN} />
    </>
  );
}

/** The same in one line, where it is always in sight; a click brings up the whole. */
export function AheadLine() {
  const statuses = watching("live");
  const { conflict, corridor_m } = aheadOf(statuses);
  const show = () => document.getElementById("mission-ahead")?.scrollIntoView({ block: "start" });
  const clear = corridor_m > 0 ? "clear of what was seen" : "no mission to look along";
  const known = statuses.length > 0 ? clear : "not watched";
  return (
    <button
      type="button"
      class={`ahead-line ${conflict ? "near" : ""}`}
      title={
        conflict ? `Conflict ${conflictWhere(conflict)}` : "The mission ahead, held against what was seen"
      }
      data-testid="ahead-line"
      data-conflict={conflict !== null}
      onClick={show}
    >
      <Icon name={conflict ? "warning" : "route"} size={16} />
      <span>
        {conflict ? (
          <strong>Conflict {conflictWhere(conflict)}</strong>
        ) : (
          `Ahead: ${whyUnheard.value === null ? known : "not known now"}`
        )}
      </span>
    </button>
  );
}

/** Whether the mission ahead meets anything that was seen, long before a region of interest holds it. */
export function MissionAhead({ source }: { source: Source }) {
  if (!hasSensors[source].value) return null;
  const statuses = watching(source);
  const ahead = aheadOf(statuses);
  return (
    <section
      class="instrument ahead"
      id={source === "live" ? "mission-ahead" : undefined}
      aria-label="Mission ahead"
      data-testid={`ahead-${source}`}
    >
      <h2>Mission ahead</h2>
      {ahead.conflict ? (
        <ConflictLine conflict={ahead.conflict} />
      ) : (
        <Clear ahead={ahead} watches={statuses.length > 0} />
      )}
      {source === "live" && <PlanAgainstSeen />}
    </section>
  );
}
