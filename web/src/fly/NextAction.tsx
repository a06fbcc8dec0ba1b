import { Changes } from "../ui/Changes";
import { openReview, recordings } from "../store/review";
import { goTo } from "../store/view";
import {
  flight,
  fly,
  isInAir,
  isObserver,
  lease,
  linkStatus,
  notInCharge,
  recorder,
  transfer,
  vehicle,
} from "../store/flying";
import { pending } from "../store/outcomes";
import { failed, whyUnheard } from "../store/reach";
import { Button } from "../ui/Button";
import { HoldButton } from "../ui/HoldButton";
import { ErrorBox, Outcome } from "../ui/Outcome";
import {
  accepted,
  CANCEL,
  adopt,
  areOthersAccepted,
  cancelTakeUp,
  checkStart,
  LEASE,
  NEXT,
  pauseFlight,
  resumeFlight,
  resumeFrom,
  startFlight,
  startSimulator,
  takeControl,
  uploadPlan,
  uploadRefusal,
} from "../vehicle/orders";
import { TransferBar } from "../vehicle/TransferBar";
import { now_ms } from "../store/clock";
import { nextStep, wordsBeside, type Step } from "./next_step";

function startLabel(): string {
  const from = resumeFrom.value;
  return from ? `Resume at item ${from}` : "Start";
}

/** `isCut`: nothing that is asked here comes to the vehicle. */
function Primary({ step, isCut }: { step: Step; isCut: boolean }) {
  const why = "why" in step ? step.why : undefined;
  const isPending = pending.value.has(NEXT);
  // Another step is another button (its key): a press that is meant for one never lands on the next.
  const plain = (
    label: string,
    icon: Parameters<typeof Button>[0]["icon"],
    act: () => void,
    disabled = false,
  ) => (
    <Button
      key={step.id}
      kind="primary"
      class="wide"
      icon={icon}
      disabled={disabled || isCut || isPending}
      testid={`next-${step.id}`}
      onClick={act}
    >
      {isPending ? `${label}…` : label}
    </Button>
  );
  switch (step.id) {
    case "simulator":
      return plain("Start the simulator", "drone", () => void startSimulator(NEXT));
    case "adopt": {
      const first = linkStatus.value?.status.candidates[0];
      return plain("Use this vehicle", "drone", () => first && void adopt(first.id));
    }
    case "again": {
      const again = linkStatus.value?.status.again;
      return plain("It is this vehicle", "drone", () => again && void adopt(again.id));
    }
    case "take_control":
      if (isObserver.value || lease.value.waits) return null;
      return (
        <HoldButton
          key={step.id}
          wide
          kind="primary"
          label={lease.value.holder && !lease.value.silent ? "Ask for control" : "Take control"}
          icon="user"
          place={LEASE}
          disabled={failed.value === "server"}
          testid="next-take_control"
          onHold={() => void takeControl()}
        />
      );
    case "upload":
      return plain("Upload the plan", "upload", () => void uploadPlan(NEXT), why !== undefined);
    case "check":
      return plain(fly.value?.preflight ? "Check again" : "Check", "check", () => void checkStart());
    case "start":
      return (
        <HoldButton
          key={step.id}
          wide
          kind="primary"
          label={startLabel()}
          icon="play"
          place={NEXT}
          disabled={why !== undefined || isCut}
          testid="next-start"
          onHold={() => void startFlight()}
        />
      );
    case "pause":
      return plain("Pause", "pause", () => void pauseFlight());
    case "resume":
      return plain("Resume", "play", () => void resumeFlight(), why !== undefined);
    case "wait":
      return plain(step.why, "clock", () => undefined, true);
  }
}

/** Beside what it ends: nothing moves when it comes and goes. */
function Cancel({ isCut }: { isCut: boolean }) {
  if (!fly.value?.can_cancel) return null;
  return (
    <Button
      icon="cross"
      disabled={isCut || pending.value.has(CANCEL)}
      title="Cancel: the vehicle goes on holding"
      testid="take-up-cancel"
      onClick={() => void cancelTakeUp()}
    />
  );
}

/** After the landing, the short way to what was flown. */
function LastFlight() {
  const phase = flight.live.value?.phase;
  const last = recordings.value?.find((recording) => recording.kind === "hedgehop");
  const hasFlown = phase === "landed" || phase === "interrupted";
  if (!hasFlown || !last || isInAir.value || recorder.value?.status.recording) return null;
  return (
    <Button
      class="wide"
      icon="play"
      testid="review-flight"
      onClick={() => {
        goTo("review");
        void openReview(last.id);
      }}
    >
      Review this flight
    </Button>
  );
}

function checkAge_s(): number {
  const checked_ms = Date.parse(fly.value?.preflight?.checked_utc ?? "");
  const age_s = (performance.timeOrigin + now_ms.value - checked_ms) / 1000;
  return Number.isFinite(age_s) ? age_s : 0;
}

/** What comes next, by what is known now. */
const presentStep = (): Step =>
  nextStep({
    link: linkStatus.value?.status ?? null,
    vehicle: vehicle.value,
    flight: flight.live.value,
    fly: fly.value,
    transfer: transfer.value,
    inAir: isInAir.value,
    mine: lease.value.mine,
    accepted: accepted.value,
    othersAccepted: areOthersAccepted(),
    check_age_s: checkAge_s(),
    obstacle: uploadRefusal(),
  });

function whoIsInCharge(): string | null {
  const { holder, silent, waits } = lease.value;
  if (!holder) return null;
  if (waits) return `${holder} has been asked for control.`;
  return silent ? `${holder} is in charge, and nothing is heard of them.` : `${holder} is in charge.`;
}

/** The next step of the flight, at the bottom of the left panel. */
export function NextAction() {
  const step = presentStep();
  const unheard = whyUnheard.value;
  // Control can be taken while nothing comes to the vehicle.
  const cut = step.id === "take_control" ? null : unheard;
  const words = wordsBeside(step, {
    unheard,
    hint: flight.live.value?.hint ?? "",
    holder: whoIsInCharge(),
    isServerHeard: failed.value !== "server",
  });
  return (
    <footer class="primary-action" data-testid="next-action" data-step={step.id}>
      <Outcome place={NEXT} />
      <Changes>
        <LastFlight />
      </Changes>
      <TransferBar />
      {words.map((sentence) => (
        <p key={sentence} class="muted action-hint">
          {sentence}
        </p>
      ))}
      {isObserver.value && <p class="muted action-hint">{notInCharge.value}.</p>}
      <ErrorBox place={CANCEL} />
      <Changes>
        <div class="next-row">
          <Primary step={step} isCut={cut !== null} />
          <Cancel isCut={cut !== null} />
        </div>
      </Changes>
    </footer>
  );
}
