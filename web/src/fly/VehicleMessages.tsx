import { clock } from "../format";
import { acknowledgeText, texts } from "../store/flying";
import { isLatched, severityLevel, severityWord, type TextEntry } from "../store/texts";
import { Button } from "../ui/Button";
import { Icon } from "../ui/Icon";

const MOST_SHOWN = 60;
const time = (entry: TextEntry) => clock(entry.last_utc_s);

function Words({ entry }: { entry: TextEntry }) {
  const level = severityLevel(entry.severity);
  return (
    <>
      <Icon name={level === "neutral" ? "info" : "warning"} size={16} />
      <div class="said">
        <span class="said-head">
          {level !== "neutral" && <strong>{severityWord(entry.severity)}</strong>}
          <time>{time(entry)}</time>
          {entry.count > 1 && <span class="times">{entry.count}×</span>}
        </span>
        <span>{entry.text}</span>
      </div>
    </>
  );
}

function Row({ entry }: { entry: TextEntry }) {
  const latched = isLatched(entry);
  return (
    <li
      class={`${severityLevel(entry.severity)} ${latched ? "latched" : ""}`}
      data-testid="vehicle-text"
      data-severity={entry.severity}
    >
      <Words entry={entry} />
      {latched && (
        <Button testid="acknowledge" onClick={() => acknowledgeText(entry.id)}>
          Seen
        </Button>
      )}
    </li>
  );
}

/** What the vehicle says, newest first. Critical words stay on top until somebody has seen them. */
export function VehicleMessages() {
  const all = texts.value;
  const ordered = [...all.filter(isLatched), ...all.filter((entry) => !isLatched(entry))];
  return (
    <section class="vehicle-messages" aria-label="Messages of the vehicle">
      <h2>Vehicle says</h2>
      {ordered.length === 0 ? (
        <p class="muted">Nothing yet.</p>
      ) : (
        <ul aria-live="polite">
          {ordered.slice(0, MOST_SHOWN).map((entry) => (
            <Row key={entry.id} entry={entry} />
          ))}
        </ul>
      )}
    </section>
  );
}
