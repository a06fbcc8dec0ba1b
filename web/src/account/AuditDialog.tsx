import { useEffect } from "preact/hooks";
import { day } from "../format";
import type { AuditDoc, AuditEntryDoc } from "../messages";
import { pending } from "../store/outcomes";
import { openDialog } from "../store/view";
import { Button } from "../ui/Button";
import { Changes } from "../ui/Changes";
import { Dialog } from "../ui/Dialog";
import { Icon } from "../ui/Icon";
import { Outcome } from "../ui/Outcome";
import { AUDIT, auditLog, EXPORT, readAudit, verifyAudit } from "./audit";

/** Commands are given while it is open. */
const EVERY_MS = 3000;
const when = (utc_s: number) => day(new Date(1000 * utc_s).toISOString());

function Verdict({ audit }: { audit: AuditDoc }) {
  const isBroken = audit.state === "broken";
  return (
    <div
      class={`audit-verdict ${audit.state}`}
      role="status"
      data-testid="audit-verdict"
      data-state={audit.state}
    >
      <Icon name={isBroken ? "warning" : audit.state === "whole" ? "check" : "question"} size={24} />
      <div>
        {audit.state === "none" && <p>No command was given to a vehicle yet.</p>}
        {audit.verdict.map((sentence, index) => (
          <p key={sentence}>{index === 0 ? <strong>{sentence}</strong> : sentence}</p>
        ))}
        {isBroken && (
          <p>
            Keep a copy of the log and of the recordings, and find out who could write to the data directory.
          </p>
        )}
        {audit.checked_utc_s !== null && <p class="muted">Verified {when(audit.checked_utc_s)}</p>}
      </div>
    </div>
  );
}

function Row({ entry }: { entry: AuditEntryDoc }) {
  return (
    <tr data-testid="audit-row">
      <td class="number">{entry.t_utc_s === null ? "" : when(entry.t_utc_s)}</td>
      <td>{entry.operator}</td>
      <td>{entry.words}</td>
      <td>{entry.result || <span class="muted">asked</span>}</td>
    </tr>
  );
}

function Newest({ entries }: { entries: readonly AuditEntryDoc[] }) {
  if (entries.length === 0) return null;
  return (
    <div class="table-scroll" tabIndex={0}>
      <table class="people">
        <caption class="visually-hidden">Newest entries first</caption>
        <thead>
          <tr>
            <th scope="col">Time</th>
            <th scope="col">By</th>
            <th scope="col">Command</th>
            <th scope="col">What came of it</th>
          </tr>
        </thead>
        <tbody>
          {entries.map((entry, index) => (
            <Row key={`${entry.t_utc_s} ${index}`} entry={entry} />
          ))}
        </tbody>
      </table>
    </div>
  );
}

/** Every command and what came of it, and whether somebody has changed the log. */
export function AuditDialog() {
  useEffect(() => {
    void readAudit();
    const timer = setInterval(() => void readAudit(), EVERY_MS);
    return () => clearInterval(timer);
  }, []);
  const audit = auditLog.value;
  const isBusy = pending.value.has(AUDIT);
  return (
    <Dialog title="Audit log" testid="audit-dialog" onClose={() => (openDialog.value = null)}>
      <Outcome place={AUDIT} />
      {audit && <Verdict audit={audit} />}
      <div class="row wrap">
        <Changes>
          <Button icon="shield" disabled={isBusy} testid="audit-verify" onClick={() => void verifyAudit()}>
            {isBusy ? "Verifying…" : "Verify now"}
          </Button>
        </Changes>
        {audit && audit.newest.length > 0 && (
          <a class="button" href={EXPORT} download data-testid="audit-export">
            <Icon name="export" /> Export table and verdict
          </a>
        )}
      </div>
      {audit && <Newest entries={audit.newest} />}
    </Dialog>
  );
}
