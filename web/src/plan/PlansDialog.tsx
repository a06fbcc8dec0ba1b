import { signal } from "@preact/signals";
import { useState } from "preact/hooks";
import { count, day } from "../format";
import type { PlanEntry } from "../messages";
import { ActionTable } from "../ui/ActionTable";
import { Button } from "../ui/Button";
import { Changes } from "../ui/Changes";
import { Dialog } from "../ui/Dialog";
import { ErrorBox } from "../ui/Outcome";
import { openDialog } from "../store/view";
import { document_, library, plan, setError } from "../store/state";
import { deletePlan, newPlan, openPlan, savePlanAs } from "../store/plans";

/** The plan whose deletion has been asked for once. */
const confirming = signal<string | null>(null);

function close(): void {
  openDialog.value = null;
  confirming.value = null;
  setError("plans", null);
}

async function closeIf(done: Promise<boolean>): Promise<void> {
  if (await done) close();
}

function PlanRow({ entry }: { entry: PlanEntry }) {
  const isOpen = entry.id === plan.value?.plan_id;
  const terrain = library.value.terrains.find((item) => item.id === entry.terrain_id);
  const isConfirming = confirming.value === entry.id;
  const remove = async () => {
    if (isConfirming) await deletePlan(entry.id);
    confirming.value = isConfirming ? null : entry.id;
  };
  return (
    <tr data-testid="plan-row" class={isOpen ? "current" : ""}>
      <th scope="row">
        {entry.name} {isOpen && <span class="tag">open</span>}
      </th>
      <td>{terrain?.name ?? "no terrain"}</td>
      <td class="number">{day(entry.saved_utc)}</td>
      <td class="actions">
        {!isOpen && (
          <Changes>
            <Button onClick={() => void closeIf(openPlan(entry.id))}>Open</Button>
            <Button
              kind={isConfirming ? "danger" : "quiet"}
              icon="trash"
              title={`Delete ${entry.name}`}
              onClick={() => void remove()}
            >
              {isConfirming ? "Delete for good" : undefined}
            </Button>
          </Changes>
        )}
      </td>
    </tr>
  );
}

/** The open plan as it is now: the library knows it as it was when the library last changed. */
function entries(): PlanEntry[] {
  const [open, now] = [plan.value, document_.value];
  if (!open || !now) return library.value.plans;
  const { name, terrain_id } = now;
  return library.value.plans.map((entry) =>
    entry.id === open.plan_id ? { ...entry, name, terrain_id, saved_utc: open.saved_utc } : entry,
  );
}

export function PlansDialog() {
  const plans = entries();
  return (
    <Dialog title="Plans" testid="plans-dialog" onClose={close}>
      <ErrorBox place="plans" />
      <div class="row">
        <Changes>
          <Button icon="plus" testid="plan-new" onClick={() => void closeIf(newPlan())}>
            New plan
          </Button>
          <Button icon="copy" testid="plan-save-as" onClick={() => (openDialog.value = "save_as")}>
            Save as…
          </Button>
        </Changes>
        <span class="muted">{count(plans.length, "plan")}; each saves itself</span>
      </div>
      <ActionTable
        head={
          <>
            <th scope="col">Name</th>
            <th scope="col">Terrain</th>
            <th scope="col">Saved</th>
          </>
        }
      >
        {plans.map((entry) => (
          <PlanRow key={entry.id} entry={entry} />
        ))}
      </ActionTable>
    </Dialog>
  );
}

export function SaveAsDialog() {
  const [name, setName] = useState(`${document_.value?.name ?? "Plan"} (copy)`);
  const submit = (event: Event) => {
    event.preventDefault();
    if (name.trim()) void closeIf(savePlanAs(name.trim()));
  };
  return (
    <Dialog title="Save under a new name" testid="save-as-dialog" onClose={close}>
      <ErrorBox place="plans" />
      <form class="stack" onSubmit={submit}>
        <p>The open plan saves itself after each change. This makes a copy and opens it.</p>
        <label class="field text">
          <span>Name</span>
          <input
            type="text"
            autofocus
            maxLength={80}
            value={name}
            data-testid="save-as-name"
            onInput={(event) => setName(event.currentTarget.value)}
          />
        </label>
        <div class="row end">
          <Button onClick={close}>Cancel</Button>
          <button type="submit" class="button primary" data-testid="save-as-submit">
            Save copy
          </button>
        </div>
      </form>
    </Dialog>
  );
}
