import { useEffect, useState } from "preact/hooks";
import { isInAir, vehicle } from "../store/flying";
import { whyNotCommand } from "../store/reach";
import { Button } from "../ui/Button";
import { HoldButton } from "../ui/HoldButton";
import { Outcome } from "../ui/Outcome";
import { EMERGENCY, stopMotors } from "../vehicle/orders";

/** So long the guard stays open: nobody finds it open later. */
const OPEN_MS = 15_000;

/** Motors off in the air, behind a guard: it is opened first, then its button is held. */
export function EmergencyStop() {
  const [isOpen, setOpen] = useState(false);
  const why = whyNotCommand.value;
  const isOffered = vehicle.value?.armed === true && isInAir.value && why === null;
  useEffect(() => {
    if (!isOpen) return undefined;
    const timer = setTimeout(() => setOpen(false), OPEN_MS);
    return () => clearTimeout(timer);
  }, [isOpen]);
  useEffect(() => {
    if (!isOffered) setOpen(false);
  }, [isOffered]);
  if (!isOpen)
    return (
      <>
        <Button
          icon="power"
          disabled={!isOffered}
          title={why ?? (isOffered ? "Opens the guard; nothing is stopped yet" : "Only in the air")}
          testid="emergency-open"
          onClick={() => setOpen(true)}
        >
          Emergency stop…
        </Button>
        <Outcome place={EMERGENCY} />
      </>
    );
  return (
    <div class="emergency" role="alertdialog" aria-label="Emergency stop" data-testid="emergency-guard">
      <p>
        <strong>The motors stop at once and the vehicle falls.</strong> Do it only where a fall does less harm
        than flying on.
      </p>
      <div class="row wrap minor-actions">
        <HoldButton
          place={EMERGENCY}
          label="Stop the motors"
          icon="power"
          disabled={!isOffered}
          title="The vehicle falls"
          testid="emergency-stop"
          onHold={() => {
            setOpen(false);
            void stopMotors();
          }}
        />
        <Button testid="emergency-cancel" onClick={() => setOpen(false)}>
          Cancel
        </Button>
      </div>
    </div>
  );
}
