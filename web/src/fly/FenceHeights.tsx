import type { FenceHeightsDoc, OnboardDoc } from "../messages";
import {
  HEIGHTS,
  changeWords,
  heights,
  heightsOf,
  heightsWritten,
  lookAtHeights,
  setHeights,
} from "../store/fence_heights";
import { pending } from "../store/outcomes";
import { Button } from "../ui/Button";
import { HoldButton } from "../ui/HoldButton";
import { Icon } from "../ui/Icon";
import { Outcome } from "../ui/Outcome";
import { WrittenList } from "./WrittenList";
import { whyNotWrite } from "./parameter_writing";

/** Old → new before anything is written, and what it means besides. */
function Shown({ doc }: { doc: FenceHeightsDoc }) {
  return (
    <>
      {doc.changes.length === 0 && (
        <p data-testid="heights-kept">
          <Icon name="check" size={16} /> The vehicle has them already.
        </p>
      )}
      {doc.changes.length > 0 && (
        <table class="rounded" data-testid="heights-changes">
          <tbody>
            {doc.changes.map((change) => (
              <tr key={`${change.name} ${change.after}`}>
                <th scope="row">{change.name}</th>
                <td>{changeWords(change)}</td>
              </tr>
            ))}
          </tbody>
        </table>
      )}
      {doc.notes.map((note) => (
        <p key={note} class="muted">
          {note}
        </p>
      ))}
    </>
  );
}

/** Floor and ceiling of the plan on board: no list of the vehicle holds them, its parameters do. */
export function FenceHeights({ onboard }: { onboard: OnboardDoc }) {
  const words = heightsOf(onboard);
  if (onboard.state !== "verified" || words === null) return null;
  const doc = heights.value;
  const why = whyNotWrite.value;
  const isBusy = pending.value.has(HEIGHTS);
  return (
    <div
      class="callout fence-heights"
      role="group"
      aria-label="Floor and ceiling"
      data-testid="fence-heights"
    >
      <p>{words}: settings of the vehicle, not sent by Upload.</p>
      {doc && <Shown doc={doc} />}
      <WrittenList written={heightsWritten.value} testid="heights-written" />
      <div class="row wrap">
        <Button
          testid="heights-look"
          disabled={why !== null || isBusy}
          title={why ?? "Reads the vehicle's settings; nothing is written"}
          onClick={() => void lookAtHeights()}
        >
          {isBusy ? "Asking the vehicle…" : doc ? "Compare again" : "Compare with the vehicle"}
        </Button>
        {doc && doc.changes.length > 0 && (
          <HoldButton
            label="Set on the vehicle"
            icon="shield"
            place={HEIGHTS}
            disabled={why !== null}
            title={why ?? "Writes what stands above and reads it back"}
            testid="heights-set"
            onHold={() => void setHeights()}
          />
        )}
      </div>
      <Outcome place={HEIGHTS} />
    </div>
  );
}
