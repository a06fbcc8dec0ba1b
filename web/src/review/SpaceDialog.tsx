import { signal } from "@preact/signals";
import { bytes, count, day, duration } from "../format";
import type { RecordingDoc } from "../messages";
import { recorder } from "../store/flying";
import { pending } from "../store/outcomes";
import { RECORDINGS, deleteRecording, recordings, review } from "../store/review";
import { openDialog } from "../store/view";
import { ActionTable } from "../ui/ActionTable";
import { Button } from "../ui/Button";
import { Changes } from "../ui/Changes";
import { DeleteForGood } from "../ui/DeleteForGood";
import { Dialog } from "../ui/Dialog";
import { Outcome } from "../ui/Outcome";

type Order = "size" | "date";

const order = signal<Order>("size");
/** The recording whose deletion has been asked for once. */
const confirming = signal<string | null>(null);

const BY: Record<Order, (a: RecordingDoc, b: RecordingDoc) => number> = {
  size: (a, b) => b.bytes - a.bytes,
  date: (a, b) => (a.started_utc ?? "").localeCompare(b.started_utc ?? ""),
};

function Head({ by, label }: { by: Order; label: string }) {
  const isBy = order.value === by;
  return (
    <th scope="col" aria-sort={isBy ? (by === "size" ? "descending" : "ascending") : undefined}>
      <button type="button" class="link" data-testid={`space-by-${by}`} onClick={() => (order.value = by)}>
        {label}
        {isBy && (by === "size" ? ", largest first" : ", oldest first")}
      </button>
    </th>
  );
}

function Row({ recording }: { recording: RecordingDoc }) {
  const isOpen = review.value?.recording.id === recording.id;
  const remove = async () => {
    await deleteRecording(recording.id);
    confirming.value = null;
  };
  return (
    <tr data-testid="space-row">
      <th scope="row">
        {recording.started_utc ? day(recording.started_utc) : "date unknown"}
        <span class="muted name">{recording.plan_name || recording.name}</span>
      </th>
      <td class="number optional">{recording.duration_s === null ? "" : duration(recording.duration_s)}</td>
      <td class="number">{bytes(recording.bytes)}</td>
      <td class="actions">
        <Changes>
          {confirming.value === recording.id ? (
            <DeleteForGood
              testid="space-delete-confirm"
              onDelete={() => void remove()}
              onKeep={() => (confirming.value = null)}
            />
          ) : (
            <Button
              icon="trash"
              disabled={isOpen || pending.value.has(RECORDINGS)}
              title={isOpen ? "Open for review: close it in Review first" : `Delete ${recording.name}`}
              testid="space-delete"
              onClick={() => (confirming.value = recording.id)}
            >
              Delete
            </Button>
          )}
        </Changes>
      </td>
    </tr>
  );
}

function close(): void {
  openDialog.value = null;
  confirming.value = null;
}

function Summary({ all }: { all: readonly RecordingDoc[] }) {
  const status = recorder.value?.status;
  const total = all.reduce((sum, recording) => sum + recording.bytes, 0);
  return (
    <p data-testid="space-summary">
      {count(all.length, "recording")}, {bytes(total)}.
      {status?.free_bytes != null && ` ${bytes(status.free_bytes)} are free on the disk.`}
      {status?.recording && ` The flight that is being recorded, ${bytes(status.bytes)}, cannot be deleted.`}
    </p>
  );
}

/** A full disk in the field: what recordings take, and out with those that nobody needs. */
export function SpaceDialog() {
  const all = recordings.value ?? [];
  return (
    <Dialog title="Free space on the disk" testid="space-dialog" onClose={close}>
      <Outcome place={RECORDINGS} />
      <Summary all={all} />
      {all.length === 0 ? (
        <p>No recording is left to be deleted: remove other files from the disk of the data directory.</p>
      ) : (
        <ActionTable
          class="space"
          isReached
          head={
            <>
              <Head by="date" label="Date" />
              <th scope="col" class="optional">
                Length
              </th>
              <Head by="size" label="Size" />
            </>
          }
        >
          {[...all].sort(BY[order.value]).map((recording) => (
            <Row key={recording.id} recording={recording} />
          ))}
        </ActionTable>
      )}
    </Dialog>
  );
}
