import { useEffect } from "preact/hooks";
import { bytes, day } from "../format";
import type { LogDownloadDoc, VehicleLogDoc } from "../messages";
import { adopted, vehicle } from "../store/flying";
import { pending } from "../store/outcomes";
import { whyNotAsk, whyNotCommand } from "../store/reach";
import { openReview } from "../store/review";
import { study, goTo } from "../store/view";
import { Bar } from "../ui/Bar";
import { Button } from "../ui/Button";
import { ErrorPanel, Outcome } from "../ui/Outcome";
import { Section } from "../ui/Section";
import { askForLogs, cancelLog, downloadLog, LOGS, lookAtLogs, vehicleLogs } from "../vehicle/logs";

const LOOK_EVERY_MS = 1000;

function inReview(recording_id: string): void {
  study.value = "flights";
  goTo("review");
  void openReview(recording_id);
}

function Download({ download }: { download: LogDownloadDoc }) {
  const share = download.bytes > 0 ? download.read_bytes / download.bytes : null;
  if (download.state === "reading") {
    return (
      <div class="row" data-testid="log-reading">
        <Bar label={`Log ${download.number}`} share={share} />
        <span class="muted">
          {bytes(download.read_bytes)} of {bytes(download.bytes)}
        </span>
        <Button icon="cross" title="Read no more of it" testid="log-cancel" onClick={() => void cancelLog()}>
          Cancel
        </Button>
      </div>
    );
  }
  if (download.state === "failed") return download.error && <ErrorPanel error={download.error} />;
  if (download.state === "cancelled") return <p class="muted">Log {download.number} was not read.</p>;
  const { recording_id } = download;
  return (
    <div class="row" data-testid="log-done">
      <span>Log {download.number} is among the recordings.</span>
      {recording_id && (
        <Button testid="log-review" onClick={() => inReview(recording_id)}>
          Review
        </Button>
      )}
    </div>
  );
}

function Row({ log, why }: { log: VehicleLogDoc; why: string | null }) {
  return (
    <li class="row" data-testid="log-row">
      <span class="connection-name">
        <strong>{log.begun_utc ? day(log.begun_utc) : "Time unknown"}</strong>
        <span class="muted">
          Log {log.number} · {bytes(log.bytes)}
        </span>
      </span>
      <Button
        icon="export"
        disabled={why !== null || log.bytes === 0}
        title={why ?? (log.bytes === 0 ? "It is empty" : "Read it into the recordings")}
        testid="log-download"
        onClick={() => void downloadLog(log.number)}
      >
        Read
      </Button>
    </li>
  );
}

function Logs() {
  const { logs, download } = vehicleLogs.value ?? { logs: null, download: null };
  const isReading = download?.state === "reading";
  useEffect(() => {
    void lookAtLogs();
    const timer = setInterval(() => void lookAtLogs(), LOOK_EVERY_MS);
    return () => clearInterval(timer);
  }, []);
  const armed = vehicle.value?.armed !== false ? "Only while the vehicle is disarmed" : null;
  const why = armed ?? whyNotCommand.value ?? (isReading ? "A log is being read" : null);
  return (
    <>
      {download && <Download download={download} />}
      <ul class="candidates">
        {logs?.map((log) => (
          <Row key={log.number} log={log} why={why} />
        ))}
      </ul>
      {logs?.length === 0 && <p class="muted">There is no log on the vehicle.</p>}
      <Button
        disabled={why !== null || whyNotAsk.value !== null || pending.value.has(LOGS)}
        title={why ?? "Reading takes the radio's whole bandwidth: large logs are sooner read over USB"}
        testid="logs-list"
        onClick={() => void askForLogs()}
      >
        {logs === null ? "List the logs" : "List again"}
      </Button>
      <Outcome place={LOGS} />
    </>
  );
}

/** The vehicle's own logs have more positions than come over the radio. */
export function LogsSection() {
  if (!adopted.value) return null;
  return (
    <Section id="vehicle-logs" title="Logs on the vehicle" icon="folder">
      <Logs />
    </Section>
  );
}
