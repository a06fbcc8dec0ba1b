import { openReview, recordings } from "../store/review";
import { goTo } from "../store/view";
import { flight, fly, isInAir, lease, linkStatus, recorder, transfer, vehicle } from "../store/flying";
import { pending } from "../store/outcomes";
import { Button } from "../ui/Button";
import { HoldButton } from "../ui/HoldButton";
import { Outcome } from "../ui/Outcome";
import {
  accepted,
  adopt,
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
} from "./commands";
import { presentStep } from "./facts";
import type { Step } from "./next_step";

const PHASES = { sending: "Sending", reading_back: "Reading back", done: "Done", failed: "Failed" } as const;

/** A mission on its way, in items. */
export function TransferBar() {
  const now = transfer.value;
  if (!now || now.phase === "done" || now.phase === "failed") return null;
  return (
    <div class="transfer" data-testid="transfer" role="status">
      <span>
        {PHASES[now.phase]} <span class="number">{`${now.done} of ${count(now.total, "item")}`}</span>
      </span>
      <Bar label={PHASES[now.phase]} share={now.total > 0 ? now.done / now.total : null} />
    </div>
  );
}

function startLabel(): string {
  const from = resumeFrom.value;
  return from ? `Resume at item ${from}` : "Start";
}

function Primary({ step }: { step: Step }) {
  const why = "why" in step ? step.why : undefined;
  const isPending = pending.value.has(NEXT);
  const plain = (
    label: string,
    icon: Parameters<typeof Button>[0]["icon"],
    act: () => void,
    disabled = false,
  ) => (
    <Button
      kind="primary"
      class="wide"
      icon={icon}
      disabled={disabled || isPending}
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
    case "take_control":
      return (
        <HoldButton
          wide
          kind="primary"
          label="Take control"
          icon="user"
          place={LEASE}
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
          wide
          kind="primary"
          label={startLabel()}
          icon="play"
          place={NEXT}
          disabled={why !== undefined}
          testid="next-start"
          onHold={() => void startFlight()}
        />
      );
    case "pause":
      return plain("Pause", "pause", () => void pauseFlight());
    case "resume":
      return plain("Resume", "play", () => void resumeFlight());
    case "wait":
      return plain(step.why, "clock", () => undefined, true);
  }
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

/** The next step of the flight, at the bottom of the left panel. */
export function NextAction() {
  const step = presentStep();
  const why = "why" in step && step.id !== "wait" ? step.why : "";
  const hint = flight.live.value?.hint ?? "";
  const observer = step.id === "take_control" && lease.value.holder;
  return (
    <footer class="primary-action" data-testid="next-action" data-step={step.id}>
      <Outcome place={NEXT} />
      <LastFlight />
      <TransferBar />
      {hint && <p class="muted action-hint">{hint}</p>}
      {why && <p class="muted action-hint">{why}</p>}
      {observer && <p class="muted action-hint">{lease.value.holder} is in charge. You see everything.</p>}
      <Primary step={step} />
    </footer>
  );
}
