import { useState } from "preact/hooks";
import type { JobDoc } from "../../messages";
import { Button } from "../../ui/Button";
import { ErrorPanel } from "../../ui/ErrorBox";
import { Check, SelectField } from "../../ui/fields";
import { forgetJob, sendTerrain, sentFiles, type RasterHints } from "../../store/files";
import { jobs } from "../../store/state";

/** Errors that a declaration of the operator can mend, or that a wrong one has made. */
const MENDABLE = new Set(["raster_no_crs", "raster", "parameter", "datum"]);

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

/** Asks for what the file does not say, and sends it again. */
function HintForm({ job, file, hints }: { job: JobDoc; file: File; hints: RasterHints }) {
  const [draft, setDraft] = useState(hints);
  const submit = (event: Event) => {
    event.preventDefault();
    forgetJob(job.id);
    void sendTerrain(file, draft);
  };
  return (
    <form class="hint-form" data-testid="raster-hints" onSubmit={submit}>
      <label class="field text">
        <span>CRS of {file.name}</span>
        <input
          type="text"
          placeholder="EPSG:32633"
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
      <Check
        label="Remove isolated spikes"
        checked={draft.remove_spikes}
        onChange={(remove_spikes) => setDraft({ ...draft, remove_spikes })}
      />
      <div class="row">
        <button type="submit" class="button accent" data-testid="raster-retry">
          Read again
        </button>
        <Button kind="quiet" onClick={() => forgetJob(job.id)}>
          Leave it
        </Button>
      </div>
    </form>
  );
}

/** Jobs that failed, where they were started, until they are dismissed. */
export function FailedJobs() {
  const failed = [...jobs.value.values()].filter((job) => job.state === "failed" && job.error);
  return (
    <>
      {failed.map((job) => {
        const sent = sentFiles.value.get(job.id);
        const asks = sent && job.error && MENDABLE.has(job.error.code);
        return (
          <div key={job.id} data-testid="failed-job">
            {job.error && <ErrorPanel error={job.error} onClose={() => forgetJob(job.id)} />}
            {asks && <HintForm job={job} {...sent} />}
          </div>
        );
      })}
    </>
  );
}
