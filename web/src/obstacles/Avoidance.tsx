import { useState } from "preact/hooks";
import { withUnit } from "../format";
import type { AvoidanceStatus } from "../messages";
import { nodes, vehicle } from "../store/flying";
import { obstacles } from "../store/obstacles";
import { failed, whyNotAsk, whyNotCommand } from "../store/reach";
import { setError } from "../store/state";
import { Button } from "../ui/Button";
import { Check } from "../ui/fields";
import { HoldButton } from "../ui/HoldButton";
import { Icon } from "../ui/Icon";
import { Outcome } from "../ui/Outcome";
import { AVOIDANCE, setPerception, switchAvoidance, wantsConsent } from "./obstacle_orders";
import { avoidanceWords, isTooFast, type AvoidanceWords } from "./obstacle_words";

const isSimulated = () => nodes.value.some((node) => node.name === "simulator" && node.state === "running");

type AvoidBy = AvoidanceStatus["by"];

const WILL: Record<AvoidBy, string> = {
  climb: "brake, climb up to 30 m above the plan, and fly the rest that much higher",
  sidestep:
    "fly past it beside the mission's line, level and clear of known ground, and back onto the line; where it cannot, it brakes and climbs up to 30 m",
};
const TITLES: Record<AvoidBy, string> = {
  climb: "Climbs by itself over what it sees",
  sidestep: "Steps aside by itself past what the radar follows; climbs where it cannot",
};

/** Chosen before it is switched on. */
function How({ by, onChange }: { by: AvoidBy; onChange: (by: AvoidBy) => void }) {
  return (
    <select
      class="avoid-by"
      aria-label="How it avoids"
      title={TITLES[by]}
      data-testid="avoid-by"
      value={by}
      onChange={(event) => onChange(event.currentTarget.value as AvoidBy)}
    >
      <option value="climb">Climb over it</option>
      <option value="sidestep">Step aside, else climb</option>
    </select>
  );
}

/** A real vehicle leaves its mission by itself only if somebody has said in words that it may. */
function Consent({ by, onDone }: { by: AvoidBy; onDone: () => void }) {
  const [agrees, setAgrees] = useState(false);
  const why = whyNotCommand.value;
  const grant = async () => {
    if (await switchAvoidance(true, by, true)) onDone();
  };
  return (
    <div class="consent" data-testid="avoidance-consent">
      <p>
        <strong>This is a real vehicle.</strong> When a sensor sees something ahead, Hedgehop will take it out
        of its mission, {WILL[by]}.
      </p>
      <p>Any stick or mode change hands it back for the rest of the flight.</p>
      <Check
        label="It may do this. I can take over at any time."
        checked={agrees}
        testid="avoidance-agree"
        onChange={setAgrees}
      />
      <div class="row wrap">
        <HoldButton
          label="Switch on"
          icon="shield"
          place={AVOIDANCE}
          disabled={!agrees || why !== null}
          title={why ?? (agrees ? undefined : "Agree first")}
          testid="avoidance-on"
          onHold={() => void grant()}
        />
        <Button kind="quiet" onClick={onDone}>
          Not now
        </Button>
      </div>
    </div>
  );
}

function Switch({ isOn, by, ask }: { isOn: boolean; by: AvoidBy; ask: () => void }) {
  const why = whyNotCommand.value;
  if (isOn) {
    return (
      <Button
        title={why ?? "From now on you steer clear yourself"}
        disabled={why !== null}
        testid="avoidance-off"
        onClick={() => void switchAvoidance(false, by)}
      >
        Switch off
      </Button>
    );
  }
  if (!isSimulated()) {
    return (
      <Button title={why ?? undefined} disabled={why !== null} testid="avoidance-ask" onClick={ask}>
        Switch on…
      </Button>
    );
  }
  return (
    <HoldButton
      label="Switch on"
      icon="shield"
      place={AVOIDANCE}
      disabled={why !== null}
      title={why ?? TITLES[by]}
      testid="avoidance-on"
      onHold={() => void switchAvoidance(true, by)}
    />
  );
}

function Speed() {
  const status = obstacles.live.value.avoidance;
  if (status.largest_speed_m_s === null || failed.value === "server") return null;
  const tooFast = isTooFast(status, vehicle.value?.ground_speed_m_s ?? null);
  return (
    <span
      class={`largest-speed ${tooFast ? "near" : ""}`}
      data-testid="largest-speed"
      data-too-fast={tooFast}
    >
      {tooFast && <Icon name="warning" size={16} />}
      {tooFast ? "Too fast to stop: at most " : "Sees far enough up to "}
      <strong>{withUnit(status.largest_speed_m_s, "m/s", 1)}</strong>.
    </span>
  );
}

/** What follows when the obstacle is behind. */
function AfterClimb() {
  const { settings, stays_higher } = obstacles.live.value;
  return (
    <>
      <Check
        label="Comes down after a climb, once certified past what was seen"
        checked={settings.comes_down}
        disabled={whyNotAsk.value !== null}
        testid="comes-down"
        onChange={(comes_down) => void setPerception({ comes_down }, AVOIDANCE)}
      />
      {stays_higher && (
        <p class="avoidance-note" data-testid="stays-higher">
          It stays higher: {stays_higher}
        </p>
      )}
    </>
  );
}

const UNHEARD: AvoidanceWords = {
  word: "Not known",
  level: "near",
  note: "This page cannot see what it does now.",
};

/** What is done about obstacles without asking, and the switch for it. */
export function Avoidance() {
  const [asks, setAsks] = useState(false);
  const [chosen, setChosen] = useState<AvoidBy>("climb");
  const status = obstacles.live.value.avoidance;
  const by = status.enabled ? status.by : chosen;
  const { word, level, note } = failed.value === "server" ? UNHEARD : avoidanceWords({ ...status, by });
  const close = () => {
    setAsks(false);
    setError(AVOIDANCE, null);
  };
  const consents = asks || (wantsConsent() && !status.enabled);
  return (
    <section
      class={`avoidance ${level}`}
      aria-label="Avoidance"
      data-testid="avoidance"
      data-state={status.state}
      data-enabled={status.enabled}
    >
      <div class="row">
        <Icon name={level === "neutral" ? "shield" : "warning"} />
        <span class="avoidance-state">
          <span class="muted">Avoidance</span>
          <strong role="status">{word}</strong>
        </span>
        {!consents && <Switch isOn={status.enabled} by={by} ask={() => setAsks(true)} />}
      </div>
      <p class="avoidance-note">
        {note} <Speed />
      </p>
      {status.enabled ? <AfterClimb /> : <How by={by} onChange={setChosen} />}
      {consents && <Consent by={by} onDone={close} />}
      <Outcome place={AVOIDANCE} />
    </section>
  );
}
