import { DASH, degreesOf, number, withUnit } from "../format";
import type { Track, TracksStatus } from "../messages";
import { distance } from "../obstacles/obstacle_words";
import { now_ms } from "../store/clock";
import { heard, type Source } from "../store/flying";
import { movingWatch, moving } from "../store/moving";
import { Icon } from "../ui/Icon";
import { inUrgency } from "./velocity";
import { TRACK_WATCH, closestWords, offNoseOf, trackName, trackSpeed, trackWords } from "./track_words";

/** Where it is, seen from the nose. */
function Bearing({ off_nose_deg }: { off_nose_deg: number | null }) {
  return (
    <svg class="track-bearing" viewBox="-8 -8 16 16" width="16" height="16" aria-hidden="true">
      {off_nose_deg === null ? (
        <circle r={2.5} />
      ) : (
        <path d="M0-7 5 6 0 3-5 6z" transform={`rotate(${off_nose_deg.toFixed(0)})`} />
      )}
    </svg>
  );
}

function Row({ track, heading_deg }: { track: Track; heading_deg: number | null }) {
  const off_nose_deg = heading_deg === null ? null : offNoseOf(track.bearing_deg, heading_deg);
  const words = trackWords(track, off_nose_deg);
  return (
    <tr class={track.dangerous ? "dangerous" : ""} title={words} data-testid="track-row" data-id={track.id}>
      <th scope="row">
        {track.dangerous && <Icon name="warning" size={14} />}
        {trackName(track.id)}
        <small class="muted">{withUnit(track.age_s, "s")}</small>
      </th>
      <td>
        <Bearing off_nose_deg={off_nose_deg} /> {distance(track.range_m)}
      </td>
      <td class={track.moving ? "" : "muted"}>{trackSpeed(track)}</td>
      <td class={track.dangerous ? "" : "muted"}>{closestWords(track)}</td>
    </tr>
  );
}

const Empty = () => (
  <tr class="empty" aria-hidden="true">
    <th>{DASH}</th>
    <td />
    <td />
    <td />
  </tr>
);

/** What is said below the rows: always one line, so that nothing moves. */
function note(status: TracksStatus, isRunning: boolean, word: string, left: number): string {
  if (!isRunning) return status.text || `Not watched: ${word}`;
  if (status.no_proposal) return status.no_proposal;
  if (status.proposal) return status.proposal.text;
  if (left > 0) return `and ${number(left)} more`;
  return status.tracks.length === 0 ? "No moving object is followed." : "";
}

/** So many rows always, filled or not. */
export const ROWS = { narrow: 3, wide: 5 } as const;

/** The moving objects around, what will come too near first: number, distance, speed, closest approach. */
export function TrackList({ source, rows }: { source: Source; rows: number }) {
  const known = moving[source].value;
  if (!known) return null;
  const { status } = known;
  const watch = movingWatch(known, source === "live", now_ms.value);
  const isRunning = watch === "running";
  const heading_rad = heard[source].value?.message.state?.heading_rad ?? null;
  const heading_deg = heading_rad === null ? null : degreesOf(heading_rad);
  const shown = inUrgency(status.tracks).slice(0, rows);
  const left = status.tracks.length + status.hidden - shown.length;
  return (
    <section
      class="instrument tracks"
      aria-label="Moving objects"
      data-testid={`tracks-${source}`}
      data-state={watch}
    >
      <h2>
        Moving objects{" "}
        <span class={TRACK_WATCH[watch].level}>{isRunning ? "" : TRACK_WATCH[watch].word}</span>
      </h2>
      <table class={isRunning ? "" : "stale"}>
        <thead>
          <tr>
            <th scope="col">No.</th>
            <th scope="col">Distance</th>
            <th scope="col">Speed</th>
            <th scope="col">Closest</th>
          </tr>
        </thead>
        <tbody>
          {shown.map((track) => (
            <Row key={track.id} track={track} heading_deg={heading_deg} />
          ))}
          {Array.from({ length: rows - shown.length }, (_, index) => (
            <Empty key={`empty-${index}`} />
          ))}
        </tbody>
      </table>
      <p class="tracks-note" data-testid="tracks-note">
        {note(status, isRunning, TRACK_WATCH[watch].word, left) || "\u00a0"}
      </p>
    </section>
  );
}
