import { useEffect, useRef, useState } from "preact/hooks";
import type { JobDoc } from "../../messages";
import { Button } from "../../ui/Button";
import { ErrorPanel } from "../../ui/Outcome";
import { Check, SelectField } from "../../ui/fields";
import {
  forgetJob,
  isCloud,
  MODEL_FILES,
  NO_HINTS,
  sendOrthophoto,
  sendTerrain,
  sentFileOf,
  sentFiles,
  type RasterHints,
} from "../../store/files";
import { jobs, terrain } from "../../store/state";
import { isGroundJob } from "../../store/traversability";
import { chooseFiles } from "../../ui/choose_files";

/** Errors that a declaration of the operator can mend, or that a wrong one has made. */
const MENDABLE = new Set(["raster_no_crs", "raster", "parameter", "datum"]);

/** Of a point cloud, larger cells mend that there would be too many. */
const mends = (name: string, code: string) =>
  MENDABLE.has(code) || (code === "raster_too_large" && isCloud(name));

const DATUMS = [
  { value: "", label: "unknown" },
  { value: "EGM96", label: "EGM96 (mean sea level)" },
  { value: "EGM2008", label: "EGM2008 (mean sea level)" },
  { value: "ellipsoid", label: "WGS84 ellipsoid" },
];

const SCALES = [
  { value: "", label: "metres" },
  { value: "0.01", label: "centimetres" },
  { value: "0.3048", label: "feet" },
];

interface FormProps {
  name: string;
  hints: RasterHints;
  /** Edge of a cloud's cells as it was made, in metres. */
  made_m?: number;
  onSubmit: (hints: RasterHints) => void;
  onLeave: () => void;
}

/** Asks for what the file does not say. */
function HintForm({ name, hints, made_m, onSubmit, onLeave }: FormProps) {
  const [draft, setDraft] = useState(hints);
  const form = useRef<HTMLFormElement>(null);
  useEffect(() => form.current?.scrollIntoView({ block: "nearest" }), []);
  const submit = (event: Event) => {
    event.preventDefault();
    onSubmit(draft);
  };
  return (
    <form ref={form} class="hint-form" data-testid="raster-hints" onSubmit={submit}>
      <label class="field text">
        <span title={name}>CRS</span>
        <input
          type="text"
          placeholder="as in the file, or EPSG:32633"
          value={draft.crs}
          data-testid="raster-crs"
          onInput={(event) => setDraft({ ...draft, crs: event.currentTarget.value.trim() })}
        />
      </label>
      <SelectField
        label="Heights are in"
        value={draft.z_scale}
        options={SCALES}
        onChange={(z_scale) => setDraft({ ...draft, z_scale })}
      />
      <SelectField
        label="Vertical datum"
        value={draft.vertical_datum}
        options={DATUMS}
        onChange={(vertical_datum) => setDraft({ ...draft, vertical_datum })}
      />
      {isCloud(name) && (
        <>
          <label class="field">
            <span>Cell, m</span>
            <input
              type="number"
              step="any"
              placeholder={made_m ? `${made_m} by density` : "by density"}
              value={draft.cell_m}
              data-testid="cloud-cell"
              onInput={(event) => setDraft({ ...draft, cell_m: event.currentTarget.value })}
            />
          </label>
          <Check
            label="Points called noise count too"
            checked={draft.keep_noise}
            testid="cloud-noise"
            onChange={(keep_noise) => setDraft({ ...draft, keep_noise })}
          />
          <p class="hint">
            Metres around a place: CRS +proj=tmerc +lat_0=45.1 +lon_0=7.2 +units=m, with its own latitude and
            longitude.
          </p>
        </>
      )}
      <Check
        label="Remove isolated spikes"
        checked={draft.remove_spikes}
        onChange={(remove_spikes) => setDraft({ ...draft, remove_spikes })}
      />
      <div class="row">
        <button type="submit" class="button accent" data-testid="raster-retry">
          Read again
        </button>
        <Button kind="quiet" onClick={onLeave}>
          Leave it
        </Button>
      </div>
    </form>
  );
}

/** A surface model that was read, read once more with other declarations; the plan then takes the new one. */
export function ReadAgain({ name, made_m, onDone }: { name: string; made_m?: number; onDone: () => void }) {
  const sent = sentFileOf(name);
  const send = (hints: RasterHints) => {
    onDone();
    if (sent) void sendTerrain(sent.file, hints, true);
    else chooseFiles(MODEL_FILES, ([file]) => file && void sendTerrain(file, hints, true));
  };
  return (
    <HintForm
      name={name}
      hints={sent?.hints ?? NO_HINTS}
      {...(made_m === undefined ? {} : { made_m })}
      onSubmit={send}
      onLeave={onDone}
    />
  );
}

/** A photo was given where a surface model belongs: it can be draped over the one in use. */
function DrapeInstead({ job, file }: { job: JobDoc; file: File }) {
  const entry = terrain.value;
  if (!entry || !job.error?.what.includes("orthomosaic")) return null;
  const drape = () => {
    forgetJob(job.id);
    void sendOrthophoto(file);
  };
  return (
    <Button icon="plus" testid="drape-instead" onClick={drape}>
      Drape it over {entry.name}
    </Button>
  );
}

/** Jobs that failed, where they were started, until they are dismissed. */
export function FailedJobs() {
  const failed = [...jobs.value.values()].filter(
    (job) => job.state === "failed" && job.error && !isGroundJob(job),
  );
  return (
    <>
      {failed.map((job) => {
        const sent = sentFiles.value.get(job.id);
        const isPhoto = job.error?.what.includes("orthomosaic") ?? false;
        const asks = sent && job.error && mends(sent.file.name, job.error.code) && !isPhoto;
        return (
          <div key={job.id} data-testid="failed-job">
            {job.error && <ErrorPanel error={job.error} onClose={() => forgetJob(job.id)} />}
            {sent && <DrapeInstead job={job} file={sent.file} />}
            {asks && (
              <HintForm
                name={sent.file.name}
                hints={sent.hints}
                onLeave={() => forgetJob(job.id)}
                onSubmit={(hints) => {
                  forgetJob(job.id);
                  void sendTerrain(sent.file, hints, sent.replaces);
                }}
              />
            )}
          </div>
        );
      })}
    </>
  );
}
