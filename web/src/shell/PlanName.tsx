import { clock } from "../format";
import { redo, undo } from "../store/plans";
import { edit } from "../store/plan";
import { document_, link, plan, saving } from "../store/state";
import { Button } from "../ui/Button";
import { Changes } from "../ui/Changes";
import { TextField } from "../ui/fields";
import { openDialog } from "../store/view";

function SavedState() {
  const state = plan.value;
  if (!state) return <span class="saved">Loading…</span>;
  const pending = link.value === "open" ? "Saving…" : "Not saved yet";
  const text = saving.value ? pending : `Saved ${clock(state.saved_utc)}`;
  return (
    <span class="saved" data-testid="saved-state">
      {text}
    </span>
  );
}

/** The plan's name, editable in place, and whether it is saved. */
export function PlanName() {
  const rename = (name: string) => name && edit("Rename plan", "plan", (doc) => ({ ...doc, name }));
  return (
    <div class="plan-name">
      <Changes>
        <TextField
          bare
          label="Plan name"
          testid="plan-name"
          value={document_.value?.name ?? ""}
          onChange={rename}
        />
      </Changes>
      <Button
        kind="quiet"
        icon="folder"
        title="Plans: open, new, save as"
        testid="plans-button"
        onClick={() => (openDialog.value = "plans")}
      />
      <SavedState />
    </div>
  );
}

export function UndoRedo() {
  const state = plan.value;
  const undoTitle = `Undo ${state?.undo_label ?? ""}`.trim();
  const redoTitle = `Redo ${state?.redo_label ?? ""}`.trim();
  return (
    <div class="group undo-redo">
      <Changes>
        <Button
          kind="quiet"
          icon="undo"
          title={`${undoTitle} (Ctrl+Z)`}
          testid="undo"
          disabled={!state?.can_undo && !saving.value}
          onClick={undo}
        />
        <Button
          kind="quiet"
          icon="redo"
          title={`${redoTitle} (Ctrl+Shift+Z)`}
          testid="redo"
          disabled={!state?.can_redo}
          onClick={redo}
        />
      </Changes>
    </div>
  );
}
