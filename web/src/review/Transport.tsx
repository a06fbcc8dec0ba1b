import { timecode } from "../format";
import {
  SPEEDS,
  isPlaying,
  length_s,
  playhead_s,
  replay,
  review,
  seek,
  seekBy,
  setSpeed,
  togglePlaying,
} from "../store/review";
import { Button } from "../ui/Button";
import { Changes } from "../ui/Changes";

function Speed() {
  const speed = replay.value?.status.speed ?? 1;
  const known = SPEEDS.some((choice) => choice === speed);
  return (
    <select
      class="speed"
      aria-label="Speed of the replay"
      data-testid="speed"
      value={String(speed)}
      onChange={(event) => setSpeed(Number(event.currentTarget.value))}
    >
      {!known && <option value={String(speed)}>{speed}×</option>}
      {SPEEDS.map((choice) => (
        <option key={choice} value={String(choice)}>
          {choice}×
        </option>
      ))}
    </select>
  );
}

/** Play, pause, ten seconds to either side, speed, and the time line. */
export function Transport() {
  if (!review.value) return null;
  const at_s = playhead_s.value ?? 0;
  const playing = isPlaying.value;
  const share = length_s() > 0 ? at_s / length_s() : 0;
  return (
    <div class="transport" role="group" aria-label="Replay">
      <Changes>
        <Button kind="quiet" title="10 s back (←)" testid="back-10" onClick={() => seekBy(-10)}>
          −10 s
        </Button>
        <Button
          icon={playing ? "pause" : "play"}
          title={playing ? "Pause (Space)" : "Play (Space)"}
          testid="transport-play"
          onClick={togglePlaying}
        />
        <Button kind="quiet" title="10 s forward (→)" testid="forward-10" onClick={() => seekBy(10)}>
          +10 s
        </Button>
        <input
          type="range"
          aria-label="Time in the recording"
          aria-valuetext={timecode(at_s)}
          data-testid="time-line"
          min={0}
          max={length_s()}
          step={0.1}
          value={at_s}
          style={{ "--share": `${share * 100}%` }}
          onInput={(event) => seek(Number(event.currentTarget.value), false)}
          onChange={(event) => seek(Number(event.currentTarget.value))}
        />
        <span class="transport-time number" data-testid="replay-time">
          {timecode(at_s)} <span class="muted">/ {timecode(length_s())}</span>
        </span>
        <Speed />
      </Changes>
    </div>
  );
}
