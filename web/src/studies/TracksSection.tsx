import { useEffect, useState } from "preact/hooks";
import { percent } from "../format";
import { LIMITS, type PoleDoc, type RadarFileDoc } from "../messages";
import { pending } from "../store/outcomes";
import { askedTracks, chosen } from "../store/studies";
import { Bar } from "../ui/Bar";
import { Button } from "../ui/Button";
import { chooseFiles } from "../ui/choose_files";
import { SelectField } from "../ui/fields";
import { NumberField } from "../ui/NumberField";
import { Section } from "../ui/Section";
import {
  TRACKS,
  cancelFollowing,
  change,
  follow,
  followingJob,
  mayHaveCapture,
  setCapture,
  setPole,
  whyNot,
} from "./tracks";

const SAY_AFTER_MS = 500;
const MOST_POLES = 20;
const FORWARD = [
  { value: "x", label: "x" },
  { value: "z", label: "z" },
  { value: "-x", label: "\u2212x" },
  { value: "-z", label: "\u2212z" },
] as const;

function Capture({ file }: { file: RadarFileDoc }) {
  return (
    <div>
      <p class="capture-name">Motion capture{file.capture_name && `: ${file.capture_name}`}</p>
      <div class="row">
        <Button
          icon="import"
          testid="radar-capture"
          onClick={() => chooseFiles(".csv", ([capture]) => capture && void setCapture(capture))}
        >
          {file.capture_name ? "Another capture…" : "Give its optitrack.csv…"}
        </Button>
        {file.capture_name && (
          <Button kind="quiet" testid="radar-capture-remove" onClick={() => void setCapture(null)}>
            Without
          </Button>
        )}
      </div>
    </div>
  );
}

function Pole({ pole, index }: { pole: PoleDoc; index: number }) {
  const remove = () => change({ poles: askedTracks.value.poles.filter((_, at) => at !== index) });
  return (
    <li class="pole" data-testid="pole">
      <strong>Pole {index + 1}</strong>
      <Button
        kind="quiet"
        class="small"
        icon="trash"
        title={`Remove pole ${index + 1}`}
        testid="pole-remove"
        onClick={remove}
      />
      {(["x", "z"] as const).map((axis) => (
        <NumberField
          key={axis}
          label={axis}
          unit="m"
          value={axis === "x" ? pole.x_m : pole.z_m}
          {...(axis === "x" ? LIMITS.PoleDoc.x_m : LIMITS.PoleDoc.z_m)}
          step={0.1}
          testid={`pole-${axis}`}
          onChange={(value) => setPole(index, axis === "x" ? { x_m: value } : { z_m: value })}
        />
      ))}
    </li>
  );
}

function Poles() {
  const { poles } = askedTracks.value;
  return (
    <>
      <ul class="poles" aria-label="Poles">
        {poles.map((pole, index) => (
          <Pole key={index} pole={pole} index={index} />
        ))}
      </ul>
      <div class="row">
        <Button
          icon="plus"
          testid="pole-add"
          disabled={poles.length >= MOST_POLES}
          onClick={() => change({ poles: [...poles, { x_m: 0, z_m: 0 }] })}
        >
          Add a pole
        </Button>
      </div>
      <p class="hint">Where each stood, in the capture's own x and z: the files do not tell.</p>
    </>
  );
}

/** How far it is, and the way out, once it takes longer than a moment. */
function Following() {
  const job = followingJob.value;
  const [isLong, setLong] = useState(false);
  useEffect(() => {
    setLong(false);
    if (!job) return undefined;
    const timer = setTimeout(() => setLong(true), SAY_AFTER_MS);
    return () => clearTimeout(timer);
  }, [job?.id]);
  if (!job || !isLong) return null;
  return (
    <div class="scenario-running" role="status" data-testid="tracks-running">
      <p>
        {job.step} {job.progress !== null && <strong>{percent(job.progress)}</strong>}
      </p>
      <Bar share={job.progress} label="Following the poles" />
      <Button kind="quiet" icon="cross" testid="tracks-cancel" onClick={() => void cancelFollowing()}>
        Cancel
      </Button>
    </div>
  );
}

/** The capture, the poles' places, and how both files belong together. */
export function TracksSection() {
  const file = chosen.value;
  if (!file || !mayHaveCapture(file)) return null;
  const asked = askedTracks.value;
  const why = whyNot(file, asked);
  return (
    <Section
      id={TRACKS}
      title="Tracks against truth"
      icon="target"
      summary={file.capture_name || "no capture"}
      startsOpen
    >
      <Capture file={file} />
      <Poles />
      <NumberField
        label="The radar begins after the capture by"
        unit="s"
        value={asked.offset_s}
        {...LIMITS.RadarTracksBody.offset_s}
        step={0.1}
        testid="tracks-offset"
        onChange={(offset_s) => change({ offset_s })}
      />
      <SelectField
        label="The captured body's nose"
        value={asked.forward}
        options={FORWARD}
        testid="tracks-forward"
        onChange={(forward) => change({ forward })}
      />
      {why && <p class="hint">{why}.</p>}
      <Button
        kind="primary"
        class="wide"
        icon="play"
        testid="tracks-follow"
        disabled={why !== null || followingJob.value !== null || pending.value.has(TRACKS)}
        title={why ?? "Follow what the samples show, and hold it against the poles"}
        onClick={() => void follow()}
      >
        Follow the poles
      </Button>
      <Following />
    </Section>
  );
}
