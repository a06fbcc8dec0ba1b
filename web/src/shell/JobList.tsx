import { percent } from "../format";
import { Bar } from "../ui/Bar";
import { Button } from "../ui/Button";
import { Changes } from "../ui/Changes";
import { ErrorBox } from "../ui/Outcome";
import { cancelJob, sending } from "../store/files";
import { runningJobs } from "../store/state";

interface Row {
  id: string;
  label: string;
  share: number | null;
  cancel: () => void;
}

function rows(): Row[] {
  const uploads = sending.value.map((file) => ({
    id: `upload-${file.id}`,
    label: `Sending ${file.name}`,
    share: file.share,
    cancel: file.cancel,
  }));
  const running = runningJobs.value.map((job) => ({
    id: job.id,
    label: job.step ? `${job.label}: ${job.step}` : job.label,
    share: job.progress,
    cancel: () => void cancelJob(job.id),
  }));
  // What has been sent only waits for its answer: the job that works on it is shown before.
  const isSent = ({ share }: Row) => share === 1;
  return [...uploads.filter((row) => !isSent(row)), ...running, ...uploads.filter(isSent)];
}

/** What the server is busy with, in the status bar. */
export function JobList() {
  const all = rows();
  return (
    <div class="jobs" aria-live="polite">
      {all.slice(0, 1).map((job) => (
        <div class="job" key={job.id} data-testid="job">
          <span class="job-label" title={job.label}>
            {job.label}
          </span>
          <Bar label={job.label} share={job.share} />
          <span class="job-share">{job.share === null ? "" : percent(job.share)}</span>
          <Changes>
            <Button
              kind="quiet"
              icon="cross"
              title={`Cancel: ${job.label}`}
              testid="job-cancel"
              onClick={job.cancel}
            />
          </Changes>
        </div>
      ))}
      {all.length > 1 && <span class="muted">and {all.length - 1} more</span>}
      <ErrorBox place="jobs" />
    </div>
  );
}
