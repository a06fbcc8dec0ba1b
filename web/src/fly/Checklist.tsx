import { Fragment } from "preact";
import { clock } from "../format";
import type { ChecklistDoc, ChecklistPoint } from "../messages";
import { CHECKLIST, isTicked, openPoints, startsHeading, tickPoint } from "../store/checklist";
import { fly, isInAir } from "../store/flying";
import { whyNotCommand } from "../store/reach";
import { Button } from "../ui/Button";
import { Icon } from "../ui/Icon";
import { ErrorBox } from "../ui/Outcome";
import { openChecklist } from "../vehicle/open_checklist";

function Point({ doc, point, number }: { doc: ChecklistDoc; point: ChecklistPoint; number: number }) {
  return (
    <li>
      <label class="check tick" title={whyNotCommand.value ?? undefined}>
        <input
          type="checkbox"
          checked={isTicked(doc, number)}
          disabled={whyNotCommand.value !== null || isInAir.value}
          data-testid={`tick-${number}`}
          onChange={(event) => void tickPoint(doc, number, event.currentTarget.checked)}
        />
        <span class="tick-text">{point.text}</span>
        {point.ticked_utc_s !== null && (
          <span class="muted tick-by">
            {point.ticked_by}, {clock(point.ticked_utc_s)}
          </span>
        )}
      </label>
    </li>
  );
}

function Points({ doc }: { doc: ChecklistDoc }) {
  return (
    <ul class="ticks" aria-label="Checklist" data-testid="checklist">
      {doc.points.map((point, index) => (
        <Fragment key={index}>
          {startsHeading(doc.points, index) && <li class="tick-heading">{point.heading}</li>}
          <Point doc={doc} point={point} number={index + 1} />
        </Fragment>
      ))}
    </ul>
  );
}

function Fault({ text }: { text: string }) {
  return (
    <p class="callout link-warning" role="alert" data-testid="checklist-fault">
      <Icon name="warning" /> <span>{text}</span>
    </p>
  );
}

/** The crew's own list: the server starts nothing before each of its points is ticked for this vehicle and mission. */
export function Checklist() {
  const doc = fly.value?.checklist;
  if (!doc) return null;
  const left = openPoints(doc);
  return (
    <div class="checklist">
      <div class="row">
        <strong>Checklist</strong>
        <span class="muted" data-testid="checklist-left">
          {doc.points.length === 0
            ? "none"
            : left === 0
              ? "all ticked"
              : `${left} of ${doc.points.length} open`}
        </span>
        <span class="spring" />
        <Button
          kind="quiet"
          testid="checklist-open"
          title={`The list of ${doc.profile}`}
          disabled={doc.fault !== ""}
          onClick={() => openChecklist(doc.profile)}
        >
          {doc.points.length === 0 ? "Write one…" : "Edit…"}
        </Button>
      </div>
      <ErrorBox place={CHECKLIST} />
      {doc.fault && <Fault text={doc.fault} />}
      {doc.why_again && left > 0 && (
        <p class="callout" data-testid="checklist-again">
          <Icon name="info" /> <span>Please look again. {doc.why_again}</span>
        </p>
      )}
      {doc.points.length > 0 && <Points doc={doc} />}
    </div>
  );
}
