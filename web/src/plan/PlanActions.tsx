import { Changes } from "../ui/Changes";
import { adopted, fly, isInAir } from "../store/flying";
import { pending } from "../store/outcomes";
import { whyNotCommand } from "../store/reach";
import { Button } from "../ui/Button";
import { ErrorBox, Outcome } from "../ui/Outcome";
import { TransferBar } from "../vehicle/TransferBar";
import { NEXT, uploadPlan, uploadRefusal } from "../vehicle/orders";
import { ExportMenu, obstacle } from "./ExportMenu";

const PLACE = "upload";

/** Why the plan cannot go to the vehicle now. */
function refusal(): string | null {
  if (whyNotCommand.value) return whyNotCommand.value;
  if (isInAir.value) return "Not while the vehicle is in the air";
  return uploadRefusal();
}

function Upload() {
  const isBusy = pending.value.has(PLACE) || pending.value.has(NEXT);
  const isThere = fly.value?.onboard.is_open_plan === true;
  return (
    <Button
      kind="primary"
      class="wide"
      icon={isThere ? "check" : "upload"}
      disabled={isBusy || isThere || refusal() !== null}
      title={refusal() ?? (isThere ? "This plan is on the vehicle" : "To the vehicle, and read back")}
      testid="upload"
      onClick={() => void uploadPlan(PLACE)}
    >
      {isBusy ? "Uploading…" : isThere ? "On board" : "Upload"}
    </Button>
  );
}

/** Upload where there is a vehicle, export otherwise. */
export function PlanActions() {
  const hasVehicle = adopted.value !== null;
  const why = obstacle() ?? (hasVehicle ? refusal() : null);
  return (
    <footer class="primary-action">
      <ErrorBox place="export" />
      {hasVehicle && (
        <>
          <Outcome place={PLACE} />
          <TransferBar />
        </>
      )}
      {why && <p class="muted action-hint">{why}</p>}
      {hasVehicle ? (
        <div class="two-actions">
          <Changes>
            <Upload />
          </Changes>
          <ExportMenu isPrimary={false} />
        </div>
      ) : (
        <ExportMenu isPrimary />
      )}
    </footer>
  );
}
