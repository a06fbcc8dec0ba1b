import { Fragment } from "preact";
import { clock } from "../format";
import type { ReviewDoc } from "../messages";
import { startsHeading } from "../store/checklist";
import { Icon } from "../ui/Icon";

/** The crew's list as it was ticked for this flight's start. */
export function Ticked({ review }: { review: ReviewDoc }) {
  const list = review.checklist;
  if (!list) return null;
  return (
    <section class="facts" data-testid="review-checklist">
      <h2>Checklist of {list.profile}</h2>
      <ul class="ticks">
        {list.points.map((point, index) => (
          <Fragment key={index}>
            {startsHeading(list.points, index) && <li class="tick-heading">{point.heading}</li>}
            <li class="ticked">
              <Icon name={point.ticked_by ? "check" : "question"} size={16} />
              <span class="tick-text">{point.text}</span>
              <span class="muted tick-by">
                {point.ticked_by}
                {point.ticked_utc_s !== null && `, ${clock(point.ticked_utc_s)}`}
              </span>
            </li>
          </Fragment>
        ))}
      </ul>
      {list.started_utc_s !== null && <p class="muted">Started at {clock(list.started_utc_s)}</p>}
    </section>
  );
}
