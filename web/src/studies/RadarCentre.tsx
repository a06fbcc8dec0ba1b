import { useEffect, useState } from "preact/hooks";
import { number, timecode, withUnit } from "../format";
import { chosen, looksAt, opened, shownFrame, shownTracks, wantedFrame } from "../store/studies";
import { errors } from "../store/state";
import { Button, Segmented } from "../ui/Button";
import { ErrorBox } from "../ui/Outcome";
import { FRAME, READING, goToFrame, isBusy, stepFrame } from "./radar";
import { RadarMaps } from "./RadarMaps";
import { ScenarioPart } from "./ScenarioPart";

const SAY_AFTER_MS = 500;
const LOOKS = [
  { value: "frames", label: "Frames" },
  { value: "tracks", label: "Tracks against truth" },
] as const;

/** Says so where an answer takes longer than a moment. */
function Working() {
  const busy = isBusy.value;
  const [isLong, setLong] = useState(false);
  useEffect(() => {
    setLong(false);
    if (!busy) return undefined;
    const timer = setTimeout(() => setLong(true), SAY_AFTER_MS);
    return () => clearTimeout(timer);
  }, [busy, wantedFrame.value]);
  if (!busy || !isLong) return null;
  return (
    <p class="study-busy" role="status" data-testid="radar-busy">
      <span class="spinner" aria-hidden="true" />
      {opened.value
        ? `Processing frame ${wantedFrame.value}…`
        : `Reading ${chosen.value?.name ?? "the file"}…`}
    </p>
  );
}

function FrameSlider() {
  const [open, at] = [opened.value, wantedFrame.value];
  if (!open) return null;
  const last = open.frames - 1;
  return (
    <div class="transport frame-slider" role="group" aria-label="Frame">
      <Button
        kind="quiet"
        icon="back"
        title="One frame back (←)"
        testid="frame-back"
        onClick={() => stepFrame(-1)}
      />
      <input
        type="range"
        aria-label="Frame"
        aria-valuetext={`Frame ${at} of 0 to ${last}`}
        data-testid="frame-slider"
        min={0}
        max={last}
        step={1}
        value={at}
        disabled={last === 0}
        style={{ "--share": `${last === 0 ? 0 : (100 * at) / last}%` }}
        onInput={(event) => goToFrame(Number(event.currentTarget.value))}
      />
      <Button
        kind="quiet"
        icon="forward"
        title="One frame on (→)"
        testid="frame-on"
        onClick={() => stepFrame(1)}
      />
      <span class="transport-time number" data-testid="frame-number">
        {number(at)} <span class="muted">of 0–{number(last)}</span>
      </span>
    </div>
  );
}

/** Between frames and tracks, once there are both. */
function Choice() {
  if (shownTracks.value === null) return null;
  return (
    <Segmented
      label="Look at"
      testid="radar-looks"
      value={looksAt.value}
      options={LOOKS}
      onChange={(next) => (looksAt.value = next)}
    />
  );
}

/** What was followed, held against where the poles truly were. */
function Tracks() {
  const found = shownTracks.value;
  return (
    <>
      <Heading />
      {found && (
        <div class="scenario-result radar-tracks" data-testid="radar-tracks" tabIndex={0}>
          <ScenarioPart part={found.part} />
        </div>
      )}
    </>
  );
}

function Heading() {
  const [file, frame, open] = [chosen.value, shownFrame.value, opened.value];
  return (
    <header class="study-head">
      <h2>{file?.name}</h2>
      <Choice />
      {looksAt.value === "frames" && frame && open && (
        <span class="muted" data-testid="frame-shown" data-frame={frame.number}>
          frame {number(frame.number)}, {timecode(frame.t_s)}, cells of{" "}
          {withUnit(open.parameters.range_resolution_m, "m", 2)} and{" "}
          {withUnit(open.parameters.velocity_resolution_m_s, "m/s", 2)}
        </span>
      )}
    </header>
  );
}

/** The range-Doppler map of a frame, the same from above, and the slider through all frames. */
export function RadarCentre() {
  const frame = shownFrame.value;
  if (!chosen.value) {
    return (
      <div class="study-empty muted">
        <p>Range-Doppler maps and detections of raw radar samples appear here, frame by frame.</p>
        <p>
          Choose a file on the left, or drop one: a complex .npy, a DCA1000 .bin, or the ODA data set's
          radar.csv with its optitrack.csv.
        </p>
      </div>
    );
  }
  if (looksAt.value === "tracks") return <Tracks />;
  return (
    <>
      <Heading />
      <Working />
      <ErrorBox place={FRAME} />
      <div class={`study-body ${!frame || frame.number === wantedFrame.value ? "" : "stale"}`}>
        {frame && <RadarMaps frame={frame} />}
        {!frame && errors.value[READING] && (
          <p class="study-empty muted">This file cannot be shown yet: what is missing stands on the left.</p>
        )}
      </div>
      <FrameSlider />
    </>
  );
}
