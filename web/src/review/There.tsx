import { useEffect } from "preact/hooks";
import { bytes, count, day, duration } from "../format";
import type { RecordingFetchDoc, RecordingThereDoc, StationRecordingsDoc } from "../messages";
import { isObserver, whyObserver } from "../store/flying";
import { pending } from "../store/outcomes";
import { openReview, review } from "../store/review";
import {
  THERE,
  askThere,
  endFetch,
  fetchOf,
  fetchThere,
  fetchWords,
  listWords,
  there,
  unlisted,
} from "../store/there";
import { Bar } from "../ui/Bar";
import { Button } from "../ui/Button";
import { Icon } from "../ui/Icon";
import { Section } from "../ui/Section";

function Fetch({ fetch }: { fetch: RecordingFetchDoc }) {
  const isOver = fetch.state === "failed";
  return (
    <div class="fetch" data-testid="fetch" data-state={fetch.state}>
      <div class="row">
        {!isOver && <Bar share={fetch.have_bytes / fetch.bytes} label={`Fetching ${fetch.name}`} />}
        <span class="muted" data-testid="fetch-words">
          {fetchWords(fetch)}
        </span>
        {isOver && (
          <Button
            kind="quiet"
            class="small"
            disabled={isObserver.value}
            testid="fetch-again"
            onClick={() => void fetchThere(fetch.station, fetch.sha256)}
          >
            Again
          </Button>
        )}
        <Button
          kind="quiet"
          class="small"
          icon="cross"
          disabled={isObserver.value}
          title={isOver ? "Put it away" : "Cancel, and delete what is there of it"}
          testid="fetch-end"
          onClick={() => void endFetch(fetch)}
        />
      </div>
      {fetch.text && fetch.state === "waiting" && <p class="hint">{fetch.text}</p>}
      {fetch.text && fetch.state !== "waiting" && (
        <p class="fault">
          <Icon name="warning" size={16} /> {fetch.text}
        </p>
      )}
    </div>
  );
}

function Row({ recording, station }: { recording: RecordingThereDoc; station: StationRecordingsDoc }) {
  const fetch = fetchOf(station.name, recording.sha256);
  const here = recording.recording_id;
  const isOpen = here !== null && review.value?.recording.id === here;
  const facts = [
    recording.duration_s === null ? "length unknown" : duration(recording.duration_s),
    bytes(recording.bytes),
    recording.vehicle,
  ].filter(Boolean);
  const why = here ? "It is here: open it" : (whyObserver.value ?? `Fetch it from ${station.name}`);
  return (
    <li class={`recording ${isOpen ? "current" : ""}`} data-testid="there-row">
      <button
        type="button"
        class="pick"
        disabled={
          (!here && (isObserver.value || station.state === "lost" || !!fetch)) || pending.value.has(THERE)
        }
        title={`${recording.name}. ${why}`}
        data-testid="there-fetch"
        onClick={() => void (here ? openReview(here) : fetchThere(station.name, recording.sha256))}
      >
        <Icon name={here ? "check" : "import"} size={16} />
        <span class="recording-text">
          <strong>{recording.started_utc ? day(recording.started_utc) : recording.name}</strong>
          <span class="muted">{facts.join(" · ")}</span>
          <span class="muted name">{recording.plan_name || recording.name}</span>
        </span>
      </button>
      {fetch && <Fetch fetch={fetch} />}
    </li>
  );
}

function Station({ station }: { station: StationRecordingsDoc }) {
  return (
    <div class="there-station" data-testid={`there-${station.name}`}>
      <h3 class={station.state === "lost" ? "old" : ""}>
        {station.name} <span class="muted">· {listWords(station)}</span>
      </h3>
      {station.text && <p class="hint">{station.text}</p>}
      {station.recordings.length > 0 ? (
        <ul class="pick-list recordings" aria-label={`Recordings of ${station.name}`}>
          {station.recordings.map((recording) => (
            <Row key={recording.sha256} recording={recording} station={station} />
          ))}
        </ul>
      ) : (
        station.listed === "listed" && !station.text && <p class="hint">It has no recordings.</p>
      )}
    </div>
  );
}

/** Recordings of other stations: listed by a look, fetched by a press. */
export function There() {
  const stations = there.value;
  const isMet = stations !== null;
  // Once, when Review is shown: the list costs the line some kilobytes.
  useEffect(() => {
    if (isMet) void askThere();
  }, [isMet]);
  if (!stations) return null;
  const all = stations.reduce((sum, { recordings }) => sum + recordings.length, 0);
  return (
    <Section id={THERE} title="Other stations" icon="signal" summary={count(all, "recording")} startsOpen>
      {stations.length === 0 && <p class="hint">No other station is heard.</p>}
      {stations.map((station) => (
        <Station key={station.name} station={station} />
      ))}
      {unlisted.value.map((fetch) => (
        <div key={fetch.sha256} class="there-station">
          <h3>
            {fetch.station} <span class="muted">· {fetch.name}</span>
          </h3>
          <Fetch fetch={fetch} />
        </div>
      ))}
      <Button kind="quiet" icon="undo" testid="there-ask" onClick={() => void askThere({ pressed: true })}>
        Ask again
      </Button>
    </Section>
  );
}
