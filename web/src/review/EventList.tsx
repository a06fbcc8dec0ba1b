import { useEffect, useRef } from "preact/hooks";
import { timecode } from "../format";
import type { ReviewDoc, ReviewEvent } from "../messages";
import { playhead_s, seek } from "../store/review";
import { severityLevel, severityWord } from "../store/texts";
import { Changes } from "../ui/Changes";
import { Icon, type IconName } from "../ui/Icon";
import { eventAt } from "./time";

const KINDS: Readonly<Record<string, IconName>> = {
  mode: "route",
  arm: "power",
  item: "flag",
  command: "user",
  text: "info",
  alert: "radar",
};

/** With a severity of their own. */
const TOLD: ReadonlySet<string> = new Set(["text", "alert", "gap"]);

function Row({ event, isNow }: { event: ReviewEvent; isNow: boolean }) {
  const row = useRef<HTMLLIElement>(null);
  const level = TOLD.has(event.kind) ? severityLevel(event.severity) : "neutral";
  useEffect(() => {
    const list = row.current?.parentElement;
    // Only the list scrolls, and not under a pointer that is choosing from it.
    if (!isNow || !list || list.matches(":hover, :focus-within")) return;
    list.scrollTop = (row.current?.offsetTop ?? 0) - list.clientHeight / 2;
  }, [isNow]);
  return (
    <li ref={row} class={`${level} ${isNow ? "now" : ""}`}>
      <button
        type="button"
        aria-current={isNow ? "time" : undefined}
        data-testid="review-event"
        data-kind={event.kind}
        onClick={() => seek(event.t_s)}
      >
        <span class="number">{timecode(event.t_s)}</span>
        <Icon name={level === "neutral" ? (KINDS[event.kind] ?? "info") : "warning"} size={16} />
        <span>
          {level !== "neutral" && <strong>{severityWord(event.severity)}: </strong>}
          {event.text}
        </span>
      </button>
    </li>
  );
}

/** What happened when; a click goes there. */
export function EventList({ review }: { review: ReviewDoc }) {
  const now = eventAt(review.events, playhead_s.value);
  return (
    <section class="events" aria-label="Events">
      <h2>Events</h2>
      {review.events.length === 0 ? (
        <p class="muted">None were recorded.</p>
      ) : (
        <Changes>
          <ol>
            {review.events.map((event, index) => (
              <Row key={`${event.t_s} ${index}`} event={event} isNow={index === now} />
            ))}
          </ol>
        </Changes>
      )}
    </section>
  );
}
