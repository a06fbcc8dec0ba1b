import { active, fleet } from "../store/fleet";
import { lease } from "../store/flying";
import { handOver, keepControl, LEASE } from "../vehicle/orders";
import { Button } from "../ui/Button";
import { ErrorBox } from "../ui/Outcome";

/** Over every view of whoever is in charge, while somebody waits for the answer. */
export function AskedForControl() {
  const { asks } = lease.value;
  if (!asks) return null;
  const name = fleet.value.find(({ number }) => number === active.value)?.name ?? "the vehicle";
  return (
    <div class="asked-for-control" role="alertdialog" aria-label="Control is asked for" data-testid="asked">
      <p>
        {asks} asks for control of {name}.
      </p>
      <div class="row">
        <Button kind="primary" testid="hand-over" onClick={() => void handOver()}>
          Hand over
        </Button>
        <Button testid="keep-control" onClick={() => void keepControl()}>
          Keep
        </Button>
      </div>
      <ErrorBox place={LEASE} />
    </div>
  );
}
