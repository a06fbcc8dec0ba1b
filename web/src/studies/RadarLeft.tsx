import { useEffect, useState } from "preact/hooks";
import { bytes, count, day } from "../format";
import { LIMITS, type RadarFileDoc, type RadarReading } from "../messages";
import { chooseFiles } from "../ui/choose_files";
import { pending } from "../store/outcomes";
import { chosen, chosenId, opened, radarFiles, reading } from "../store/studies";
import { pageId } from "../store/state";
import { Button } from "../ui/Button";
import { DeleteForGood } from "../ui/DeleteForGood";
import { AutoField, SelectField } from "../ui/fields";
import { Section } from "../ui/Section";
import { TracksSection } from "./TracksSection";
import { ENDINGS, FILES, READING, bringIn, choose, learnFiles, readAs, remove, setCfg } from "./radar";

function Delete({ file }: { file: RadarFileDoc }) {
  const [asks, setAsks] = useState(false);
  if (!asks) {
    const title = `Delete ${file.name}`;
    return (
      <Button
        kind="quiet"
        class="small"
        icon="trash"
        title={title}
        testid="radar-delete"
        onClick={() => setAsks(true)}
      />
    );
  }
  return (
    <DeleteForGood
      testid="radar-delete-confirm"
      onDelete={() => void remove(file.id)}
      onKeep={() => setAsks(false)}
    />
  );
}

function Row({ file }: { file: RadarFileDoc }) {
  const isChosen = file.id === chosenId.value;
  return (
    <li class={`recording ${isChosen ? "current" : ""}`} data-testid="radar-row">
      <button
        type="button"
        class="pick"
        aria-pressed={isChosen}
        title={file.name}
        data-testid="radar-choose"
        onClick={() => choose(file.id)}
      >
        <span class="radio" aria-hidden="true" />
        <span class="recording-text">
          <strong>{file.name}</strong>
          <span class="muted">
            {bytes(file.bytes)} · {day(file.added_utc)}
          </span>
          {file.cfg_name && <span class="muted name">with {file.cfg_name}</span>}
          {file.capture_name && <span class="muted name">with {file.capture_name}</span>}
        </span>
      </button>
      <Delete file={file} />
    </li>
  );
}

function Files() {
  const all = radarFiles.value;
  useEffect(() => void learnFiles(), [pageId.value]);
  return (
    <Section
      id={FILES}
      title="Radar files"
      icon="radar"
      summary={all === null ? "…" : count(all.length, "file")}
      startsOpen
    >
      {all !== null && all.length > 0 && (
        <ul class="pick-list recordings" aria-label="Radar files">
          {all.map((file) => (
            <Row key={file.id} file={file} />
          ))}
        </ul>
      )}
      <div class={`drop-zone ${all?.length === 0 ? "first" : ""}`}>
        {all?.length === 0 && (
          <p>Raw samples: .npy, .bin of a DCA1000, radar.csv of the ODA data set, with its optitrack.csv.</p>
        )}
        <div class="row">
          <Button
            icon="import"
            testid="radar-import"
            disabled={pending.value.has(FILES)}
            onClick={() => chooseFiles(ENDINGS, (files) => void bringIn(files), { several: true })}
          >
            Open radar files…
          </Button>
        </div>
      </div>
    </Section>
  );
}

type Sensor = "usual" | NonNullable<RadarReading["sensor"]>;

const SENSORS: readonly { value: Sensor; label: string }[] = [
  { value: "usual", label: "By the file's ending" },
  { value: "awr1843", label: "TI AWR1843" },
  { value: "position2go", label: "Infineon Position2Go" },
];
const SAMPLES = [
  { value: "auto", label: "Told by the samples" },
  { value: "twos-complement", label: "Two's complement" },
  { value: "offset-binary", label: "Offset binary" },
] as const;

function Configuration({ file }: { file: RadarFileDoc }) {
  return (
    <div class="field wide">
      <span>Configuration{file.cfg_name && `: ${file.cfg_name}`}</span>
      <div class="row">
        <Button
          icon="import"
          testid="radar-cfg"
          onClick={() => chooseFiles(".cfg,.txt", ([cfg]) => cfg && void setCfg(cfg))}
        >
          {file.cfg_name ? "Another .cfg…" : "Give its .cfg…"}
        </Button>
        {file.cfg_name && (
          <Button kind="quiet" testid="radar-cfg-remove" onClick={() => void setCfg(null)}>
            Without
          </Button>
        )}
      </div>
    </div>
  );
}

/** What the file does not tell itself. */
function Reading() {
  const file = chosen.value;
  if (!file) return null;
  const { sensor, samples, most } = reading.value;
  return (
    <Section
      id={READING}
      title="Read as"
      icon="signal"
      summary={file.cfg_name || "usual parameters"}
      startsOpen
    >
      <SelectField
        label="Radar"
        value={sensor ?? "usual"}
        options={SENSORS}
        testid="radar-sensor"
        onChange={(next) => readAs({ sensor: next === "usual" ? null : next })}
      />
      <Configuration file={file} />
      <SelectField
        label="16-bit samples"
        value={samples ?? "auto"}
        options={SAMPLES}
        testid="radar-samples"
        onChange={(next) => readAs({ samples: next })}
      />
      <AutoField
        label="Only the first frames"
        unit=""
        auto={opened.value ? `(all ${opened.value.frames})` : "(all)"}
        value={most ?? null}
        initial={opened.value?.frames ?? 1}
        {...LIMITS.RadarReading.most}
        step={1}
        whole
        testid="radar-most"
        onChange={(next) => readAs({ most: next })}
      />
    </Section>
  );
}

/** Which file is looked at, and how it is read. */
export function RadarLeft() {
  return (
    <div class="panel-scroll">
      <Files />
      <Reading />
      <TracksSection />
    </div>
  );
}
