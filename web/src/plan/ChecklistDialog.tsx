import { useEffect } from "preact/hooks";
import { day } from "../format";
import type { ChecklistText } from "../messages";
import {
  WRITING,
  checklistText,
  draftOf,
  keepDraft,
  profileShown,
  readChecklist,
  writeChecklist,
} from "../store/checklist";
import { pending } from "../store/outcomes";
import { openDialog } from "../store/view";
import { Button } from "../ui/Button";
import { Changes } from "../ui/Changes";
import { Dialog } from "../ui/Dialog";
import { Outcome } from "../ui/Outcome";

function Actions({ kept, draft }: { kept: ChecklistText; draft: string | null }) {
  const { before, suggested, profile } = kept;
  const text = draft ?? kept.text;
  const isSaving = pending.value.has(WRITING);
  return (
    <div class="row wrap">
      <Changes>
        <Button
          kind="primary"
          testid="checklist-save"
          disabled={draft === null || draft === kept.text || isSaving}
          onClick={() => void writeChecklist(text)}
        >
          {isSaving ? "Saving…" : "Save"}
        </Button>
        <Button
          testid="checklist-suggested"
          disabled={text === suggested}
          onClick={() => keepDraft(profile, suggested)}
        >
          Take the suggested one
        </Button>
        {before !== null && before !== text && (
          <Button icon="undo" testid="checklist-before" onClick={() => keepDraft(profile, before)}>
            The one before
          </Button>
        )}
        {draft !== null && draft !== kept.text && (
          <Button kind="quiet" testid="checklist-discard" onClick={() => keepDraft(profile, null)}>
            Discard what is not saved
          </Button>
        )}
      </Changes>
    </div>
  );
}

/** The text of a vehicle profile's list. */
export function ChecklistDialog() {
  const profile = profileShown.value;
  useEffect(() => void readChecklist(), [profile]);
  const kept = checklistText.value;
  const draft = draftOf(profile);
  return (
    <Dialog
      title={`Checklist of ${profile}`}
      testid="checklist-dialog"
      onClose={() => (openDialog.value = null)}
    >
      <p>
        One point a line; a line that begins with # is a heading. Before each start with this profile every
        point is ticked for the vehicle and the mission on board, or Hedgehop does not start it. An empty list
        demands nothing.
      </p>
      <Outcome place={WRITING} />
      {kept && (
        <Changes>
          <textarea
            class="checklist-text"
            aria-label="Points"
            data-testid="checklist-text"
            rows={14}
            autofocus
            value={draft ?? kept.text}
            onInput={(event) => keepDraft(profile, event.currentTarget.value)}
          />
        </Changes>
      )}
      {kept && <Actions kept={kept} draft={draft} />}
      {kept?.changed_utc && (
        <p class="muted" data-testid="checklist-changed">
          Changed by {kept.changed_by}, {day(kept.changed_utc)}. What is ticked of an older text is asked
          again.
        </p>
      )}
    </Dialog>
  );
}
