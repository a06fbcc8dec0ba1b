import { Changes } from "../ui/Changes";
import { useState } from "preact/hooks";
import { bytes, count, day, duration } from "../format";
import type { RecordingDoc } from "../messages";
import { chooseFiles } from "../ui/choose_files";
import { MapExports } from "../obstacles/MapExports";
import { isBag, sendBag } from "../store/bags";
import { sendRecording } from "../store/files";
import { hasSensors } from "../store/obstacles";
import { pending } from "../store/outcomes";
import {
  PLAYING,
  RECORDINGS,
  againstOpenPlan,
  closeReview,
  deleteRecording,
  fileOf,
  imported,
  isPlaying,
  openReview,
  opening,
  recordings,
  review,
  terrainChoice,
  togglePlaying,
} from "../store/review";
import { library } from "../store/state";
import { frame } from "../store/stream";
import { goTo, study } from "../store/view";
import { Button } from "../ui/Button";
import { DeleteForGood } from "../ui/DeleteForGood";
import { Icon } from "../ui/Icon";
import { Done, Outcome } from "../ui/Outcome";
import { Section } from "../ui/Section";
import { Check } from "../ui/fields";
import { Bags } from "./Bags";
import { StudyLeft } from "./Studies";
import { There } from "./There";

/** Recordings that were dropped or chosen: imported, and the last of them opened. */
export function takeRecordings(files: readonly File[]): void {
  if (files.length > 0) {
    study.value = "flights";
    goTo("review");
  }
  files.forEach((file) => void take(file));
}

/** A bag is asked about first. */
const take = async (file: File) =>
  (await isBag(file).catch(() => false)) ? sendBag(file) : sendRecording(file, imported);

function Import({ isFirst }: { isFirst: boolean }) {
  return (
    <div class={`drop-zone ${isFirst ? "first" : ""}`} data-testid="recording-drop">
      {isFirst && (
        <p>
          Drop a .mcap, .tlog, .bin, .ulg or ROS bag anywhere on this page. Flights are recorded by
          themselves.
        </p>
      )}
      <div class="row">
        <Button
          icon="import"
          testid="recording-import"
          onClick={() => chooseFiles(".mcap,.tlog,.bin,.ulg,.bag,.db3,.zip", takeRecordings)}
        >
          Open a recording…
        </Button>
      </div>
    </div>
  );
}

function RowActions({ recording, isOpen }: { recording: RecordingDoc; isOpen: boolean }) {
  const [asks, setAsks] = useState(false);
  if (asks) {
    return (
      <DeleteForGood
        testid="recording-delete-confirm"
        onDelete={() => void deleteRecording(recording.id).then(() => setAsks(false))}
        onKeep={() => setAsks(false)}
      />
    );
  }
  return (
    <span class="row-actions">
      <a
        class="button quiet bare small"
        href={fileOf(recording)}
        download
        title={`Download ${recording.name}`}
        aria-label={`Download ${recording.name}`}
        data-testid="recording-download"
      >
        <Icon name="export" />
      </a>
      <Button
        kind="quiet"
        class="small"
        icon="trash"
        disabled={isOpen}
        title={isOpen ? "Close it before deleting" : `Delete ${recording.name}`}
        testid="recording-delete"
        onClick={() => setAsks(true)}
      />
    </span>
  );
}

function Row({ recording }: { recording: RecordingDoc }) {
  const isOpen = review.value?.recording.id === recording.id;
  const facts = [
    recording.duration_s === null ? "length unknown" : duration(recording.duration_s),
    bytes(recording.bytes),
    recording.kind === "tlog" ? "tlog" : recording.vehicle,
    recording.station && `from ${recording.station}`,
  ].filter(Boolean);
  return (
    <li class={`recording ${isOpen ? "current" : ""}`} data-testid="recording-row" data-open={isOpen}>
      <button
        type="button"
        class="pick"
        aria-pressed={isOpen}
        disabled={pending.value.has(RECORDINGS)}
        title={recording.name}
        data-testid="recording-open"
        onClick={() => !isOpen && void openReview(recording.id)}
      >
        <span class="radio" aria-hidden="true" />
        <span class="recording-text">
          <strong>{recording.started_utc ? day(recording.started_utc) : recording.name}</strong>
          <span class="muted">{facts.join(" · ")}</span>
          <span class="muted name">{recording.plan_name || recording.name}</span>
        </span>
      </button>
      <RowActions recording={recording} isOpen={isOpen} />
      {recording.fault && (
        <p class="fault">
          <Icon name="warning" size={16} /> {recording.fault}
        </p>
      )}
    </li>
  );
}

function Recordings() {
  const all = recordings.value;
  return (
    <Section
      id="recordings"
      title="Recordings"
      icon="folder"
      summary={all === null ? "…" : count(all.length, "flight")}
      startsOpen
    >
      <Done place={RECORDINGS} />
      {all !== null && all.length > 0 && (
        <ul class="pick-list recordings" aria-label="Recordings">
          {all.map((recording) => (
            <Row key={recording.id} recording={recording} />
          ))}
        </ul>
      )}
      {pending.value.has(RECORDINGS) && (
        <p class="hint row" role="status">
          <span class="spinner" aria-hidden="true" />
          {opening.value ? "Reading and judging the flight…" : "Working on it…"}
        </p>
      )}
      <Import isFirst={all?.length === 0} />
    </Section>
  );
}

/** What the flight is judged against: which surface model, which plan. */
function Judge() {
  const open = review.value;
  if (!open) return null;
  const again = () => void openReview(open.recording.id);
  return (
    <Section id="judge" title="Judged against" icon="target" summary={open.plan_name || "no plan"} startsOpen>
      <label class="field wide">
        <span>Surface model</span>
        <select
          data-testid="review-terrain"
          value={terrainChoice.value ?? ""}
          onChange={(event) => {
            terrainChoice.value = event.currentTarget.value || null;
            again();
          }}
        >
          <option value="">
            {open.terrain_name && terrainChoice.value === null ? open.terrain_name : "As flown"}
          </option>
          {library.value.terrains.map((entry) => (
            <option key={entry.id} value={entry.id}>
              {entry.name}
            </option>
          ))}
        </select>
      </label>
      <Check
        label="The plan that is open, instead of the recorded one"
        checked={againstOpenPlan.value}
        testid="review-open-plan"
        onChange={(yes) => {
          againstOpenPlan.value = yes;
          again();
        }}
      />
      <Button kind="quiet" icon="cross" testid="review-close" onClick={() => void closeReview()}>
        Close this recording
      </Button>
    </Section>
  );
}

/** The maps as they are at the time that is shown: at the end, all that was seen. */
function Maps() {
  if (!review.value || !hasSensors.replay.value) return null;
  return (
    <Section id="maps" title="Maps" icon="radar" summary="up to the time shown" startsOpen>
      <MapExports source="replay" />
      <Button kind="quiet" icon="top" testid="maps-from-above" onClick={() => frame("top")}>
        Look at it from above
      </Button>
    </Section>
  );
}

function Play() {
  const isOpen = review.value !== null;
  const playing = isPlaying.value;
  return (
    <footer class="primary-action">
      <Outcome place={PLAYING} />
      {!isOpen && <p class="muted action-hint">{opening.value ? "Opening…" : "Choose a recording first"}</p>}
      <Changes>
        <Button
          kind="primary"
          class="wide"
          icon={playing ? "pause" : "play"}
          disabled={!isOpen}
          testid="play"
          onClick={togglePlaying}
        >
          {playing ? "Pause" : "Play"}
        </Button>
      </Changes>
    </footer>
  );
}

/** Which flight is looked at, against what, and Play as the one primary action. */
function FlightsLeft() {
  return (
    <>
      <div class="panel-scroll">
        <Recordings />
        <There />
        <Bags />
        <Judge />
        <Maps />
      </div>
      <Play />
    </>
  );
}

/** Flights, or what else is looked at. */
export const ReviewLeft = () => <StudyLeft flights={FlightsLeft} />;
