import { clock, duration } from "../format";
import { LEASE, SAFETY, holdPosition, returnHome, giveControl, takeControl } from "../vehicle/orders";
import {
  batteryLevel,
  batteryWord,
  fixLevel,
  fixWord,
  linkWords,
  modeWord,
  nodeWord,
} from "../vehicle/vehicle_words";
import { returnTitle } from "../vehicle/return_words";
import { now_ms } from "../store/clock";
import { wayInUse } from "../vehicle/way_words";
import {
  adopted,
  hasLinkFailed,
  isRecorderDown,
  latched,
  isObserver,
  lease,
  linkState,
  linkStatus,
  recorded_s,
  recorder,
  silence_s,
  troubledNodes,
  vehicle,
} from "../store/flying";
import { acknowledgeLoss, isLossCalling } from "../store/losses";
import { pending } from "../store/outcomes";
import { failed, isOld, late_s, unheard_s, whyNotCommand, whyUnheard } from "../store/reach";
import { isReplaying, review } from "../store/review";
import { severityWord } from "../store/texts";
import { Chip } from "../ui/Chip";
import { Button } from "../ui/Button";
import { HoldButton } from "../ui/HoldButton";
import { Icon } from "../ui/Icon";
import { Outcome } from "../ui/Outcome";
import { goTo, viewId } from "../store/view";
import { SoundWaits } from "./SoundSwitch";

/** Known to be disarmed just now. In doubt the vehicle may be in the air. */
function isParked(): boolean {
  return vehicle.value?.armed === false && !isOld("live", "heartbeat");
}

/** Why the vehicle cannot be stopped or called home from this page; null: it can. */
const whyNot = () => whyNotCommand.value ?? (isParked() ? "The vehicle is disarmed" : null);

/** Always at the same place while a vehicle is connected: stop where you are, and come back. */
function Safety() {
  const why = whyNot();
  const mayCommand = why === null;
  return (
    <div class="safety" role="group" aria-label="Safety">
      {isReplaying.value && <strong class="live-tag">LIVE</strong>}
      <button
        type="button"
        class="button hold-position"
        disabled={!mayCommand}
        aria-disabled={pending.value.has(SAFETY)}
        title={why ?? "Stop and hold the position, at once"}
        data-testid="hold-position"
        onClick={() => !pending.value.has(SAFETY) && void holdPosition()}
      >
        <Icon name="pause" />
        <span>Hold</span>
      </button>
      <HoldButton
        label="Return"
        icon="return"
        kind="return"
        place={SAFETY}
        disabled={!mayCommand}
        title={why ?? returnTitle(now_ms.value) ?? "Return home and land"}
        testid="return-home"
        onHold={() => void returnHome()}
      />
      {whyUnheard.value && (
        <span class="safety-why" role="alert" data-testid="safety-why">
          {whyUnheard.value}
        </span>
      )}
      <div class="safety-says">
        <Outcome place={SAFETY} />
      </div>
    </div>
  );
}

function VehicleChips() {
  const state = vehicle.value;
  const status = linkStatus.value?.status ?? null;
  const silent_s = failed.value === null ? silence_s.value : unheard_s.value;
  const words = linkWords(status, silent_s, linkState.value, failed.value, late_s.value);
  return (
    <>
      <Chip
        icon="drone"
        text={modeWord(state)}
        note={state?.armed ? "armed" : "disarmed"}
        stale={isOld("live", "heartbeat")}
        level={state?.critical ? "bad" : "neutral"}
        testid="chip-mode"
        class="mode"
        title={state?.critical ? "The vehicle reports a failsafe" : "Mode and mission item"}
      />
      <Chip
        icon="signal"
        {...words}
        testid="chip-link"
        class="link-chip"
        title={`Link quality and round trip ${wayInUse(status?.ways ?? [])}`.trim()}
      />
      <Chip
        icon="satellite"
        text={fixWord(state)}
        note={state?.satellites == null ? "" : String(state.satellites)}
        stale={isOld("live", "gnss")}
        level={fixLevel(state)}
        testid="chip-gnss"
        class="gnss"
        title="GNSS fix and satellites"
      />
      <Chip
        icon="battery"
        text={batteryWord(state)}
        stale={isOld("live", "battery")}
        level={batteryLevel(state)}
        testid="chip-battery"
        class="battery"
        title="Battery left"
      />
    </>
  );
}

function Recording() {
  const error = recorder.value?.status.error;
  const seconds = recorded_s.value;
  if (error)
    return <Chip icon="warning" text="Not recording" level="bad" title={error.what} testid="chip-rec" />;
  if (seconds === null) return null;
  if (failed.value === "server" || isRecorderDown.value)
    return (
      <Chip
        icon="question"
        text="REC"
        stale
        title="Whether it is still being recorded is not known"
        testid="chip-rec"
        class="rec"
      />
    );
  return (
    <span class="chip rec" data-testid="chip-rec" title="This flight is being recorded">
      <span class="rec-dot" aria-hidden="true" />
      <strong>REC</strong> {duration(seconds)}
    </span>
  );
}

const NODE_STATES: Readonly<Record<string, string>> = {
  silent: "does not answer",
  restarting: "starts again",
};

/** Silences the alarm of what is lost; that it is lost stays on the screen. */
function LossCalls() {
  if (!isLossCalling.value) return null;
  return (
    <button
      type="button"
      class="chip bad loss"
      title="The alarm stops; what is lost stays on the screen"
      data-testid="loss-acknowledge"
      onClick={acknowledgeLoss}
    >
      <Icon name="check" size={16} />
      <strong>Acknowledge</strong> <kbd>K</kbd>
    </button>
  );
}

/** The newest message that nobody has acknowledged, and nodes that ended: to be seen in every view. */
function Alerts() {
  const worst = latched.value[0];
  // Of a link that has failed the link's own chip and the words beside Hold tell.
  const node = troubledNodes.value.find(({ name }) => name !== "link" || !hasLinkFailed.value);
  return (
    <>
      {worst && (
        <button type="button" class="chip bad alert" data-testid="chip-alert" onClick={() => goTo("fly")}>
          <Icon name="warning" size={16} />
          <strong>{severityWord(worst.severity)}</strong>
          <span class="alert-text">{worst.text}</span>
          <span class="visually-hidden">, heard {clock(worst.last_utc_s)}</span>
        </button>
      )}
      {linkStatus.value?.status.warnings[0] && (
        <Chip
          icon="warning"
          text="Link warning"
          level="near"
          title={linkStatus.value.status.warnings.join(" ")}
          testid="chip-link-warning"
          class="node"
        />
      )}
      {node && (
        <Chip
          icon="warning"
          text={`${nodeWord(node.name)} ${NODE_STATES[node.state] ?? node.state}`}
          level="near"
          title={node.text}
          testid="chip-node"
          class="node"
        />
      )}
    </>
  );
}

function Replaying() {
  const open = review.value;
  if (!open) return null;
  return (
    <button
      type="button"
      class="replay-badge"
      data-testid="replay-badge"
      title={`Open for review: ${open.recording.name}`}
      onClick={() => goTo("review")}
    >
      REPLAY
    </button>
  );
}

function takes(holder: string | null, silent: boolean): string {
  if (!holder) return "You will command the vehicle";
  return silent ? `Nothing is heard of ${holder}: takes the command` : `Asks ${holder}, who can hand it over`;
}

/** While the server is not heard somebody else may take the command. */
function part(mine: boolean, holder: string | null, isKnown: boolean): string {
  if (mine) return isKnown ? "In charge" : "Was in charge";
  if (isObserver.value) return "Observer";
  if (holder) return "Looking on";
  return isKnown ? "Nobody in charge" : "Nobody was in charge";
}

function Operator() {
  const { holder, mine, silent, waits } = lease.value;
  const isKnown = failed.value !== "server";
  const own = isKnown ? "You command the vehicle" : "Whether you still command the vehicle is not known";
  const who = `${holder ?? "Nobody"} ${isKnown ? "is" : "was"} in charge`;
  return (
    <div class={mine ? "operator" : "operator looks-on"}>
      <Chip
        icon={mine ? "user" : "eye"}
        text={part(mine, holder, isKnown)}
        title={mine ? own : who}
        stale={!isKnown}
        testid="chip-operator"
      />
      {!mine && holder && (
        <span class="muted operator-holder">
          {who}
          {silent ? ", silent" : ""}
        </span>
      )}
      {waits && (
        <Button kind="quiet" testid="ask-no-more" onClick={() => void giveControl()}>
          Ask no more
        </Button>
      )}
      {!mine && !waits && !isObserver.value && (
        <HoldButton
          label={holder && !silent ? "Ask for control" : "Take control"}
          icon="user"
          place={LEASE}
          disabled={failed.value === "server"}
          title={takes(holder, silent)}
          testid="take-control"
          onHold={() => void takeControl()}
        />
      )}
      <div class="operator-says">
        <Outcome place={LEASE} />
      </div>
    </div>
  );
}

/** Vehicle, link, recording and operator, in every view: there as soon as there is anything of it to say. */
export function VehicleStrip() {
  const hasVehicle = adopted.value !== null;
  const isNeeded = hasVehicle || review.value !== null || viewId.value !== "plan";
  if (!isNeeded) return <div class="no-strip" />;
  return (
    <section class="vehicle-strip" aria-label="Vehicle" data-testid="vehicle-strip">
      {hasVehicle ? (
        <>
          <Safety />
          <VehicleChips />
        </>
      ) : (
        <Chip icon="drone" text="No vehicle" testid="chip-mode" title="Connect one in Fly" />
      )}
      <Recording />
      <span class="spring" />
      <SoundWaits />
      <LossCalls />
      <Alerts />
      <Replaying />
      <Operator />
    </section>
  );
}
