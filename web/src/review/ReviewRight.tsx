import { signal } from "@preact/signals";
import { day, duration } from "../format";
import type { ReviewDoc } from "../messages";
import { Health } from "../vehicle/Health";
import { Instruments } from "../vehicle/Instruments";
import { MissionAhead } from "../obstacles/MissionAhead";
import { Looking } from "../obstacles/Looking";
import { Sensors } from "../obstacles/Sensors";
import { ROWS, TrackList } from "../tracks/TrackList";
import { TrafficList } from "../traffic/TrafficList";
import { review } from "../store/review";
import { Segmented } from "../ui/Button";
import { Icon } from "../ui/Icon";
import { OtherSurface } from "../ui/OtherSurface";
import { EventList } from "./EventList";
import { Figures } from "./Figures";
import { StudyRight } from "./Studies";
import { Ticked } from "./Ticked";

type Part = "figures" | "instruments" | "events";

const part = signal<Part>("figures");

function Notes({ open }: { open: ReviewDoc }) {
  const others = open.notes.filter((note) => note !== open.other_surface);
  const all = [...(open.recording.fault ? [open.recording.fault] : []), ...others];
  if (all.length === 0) return null;
  return (
    <section class="facts">
      <h2>Please note</h2>
      <ul class="warnings" data-testid="review-notes">
        {all.map((note) => (
          <li key={note}>
            <Icon name="warning" />
            <span>{note}</span>
          </li>
        ))}
      </ul>
    </section>
  );
}

function Head({ open }: { open: ReviewDoc }) {
  return (
    <header class="replay-head">
      <strong class="replay-word">REPLAY</strong>
      <span>{day(open.start_utc)}</span>
      <span class="muted replay-name" title={open.recording.name}>
        {duration(open.duration_s)} · {open.plan_name || open.recording.name}
      </span>
    </header>
  );
}

/** What is true about a recorded flight: all of it where there is room, one part at a time where there is not. */
function FlightsRight() {
  const open = review.value;
  if (!open) {
    return (
      <div class="panel-scroll truth" tabIndex={0}>
        <div class="teaching">
          <p>
            How far beside the plan, how near the surface model, how late: the figures of a flight appear
            here.
          </p>
          <p>Other ground stations' logs (.tlog) and vehicles' own (.bin, .ulg) are opened just the same.</p>
        </div>
      </div>
    );
  }
  return (
    <div class="review-right" data-part={part.value}>
      <Head open={open} />
      <OtherSurface text={open.other_surface} />
      <div class="review-parts">
        <Segmented
          label="Part"
          testid="review-part"
          value={part.value}
          options={[
            { value: "figures", label: "Figures" },
            { value: "instruments", label: "Instruments" },
            { value: "events", label: "Events" },
          ]}
          onChange={(next) => (part.value = next)}
        />
      </div>
      <div class="panel-scroll truth" tabIndex={0}>
        <div class="part part-instruments">
          <Instruments source="replay" />
          <Health source="replay" />
          <TrackList source="replay" rows={ROWS.narrow} />
          <TrafficList source="replay" />
          <MissionAhead source="replay" />
          <Sensors source="replay" />
          <Looking source="replay" />
        </div>
        <div class="part part-figures">
          <Figures review={open} />
          <Ticked review={open} />
          <Notes open={open} />
        </div>
        <div class="part part-events">
          <EventList review={open} />
        </div>
      </div>
    </div>
  );
}

/** What is true about a flight, or about what else is looked at. */
export const ReviewRight = () => <StudyRight flights={FlightsRight} />;
