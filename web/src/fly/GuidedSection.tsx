import { clearance, demanded, metres, withUnit } from "../format";
import { LIMITS, type WayDoc } from "../messages";
import { adopted, flight, isInAir } from "../store/flying";
import { guided } from "../store/guided";
import { pending } from "../store/outcomes";
import { whyNotCommand } from "../store/reach";
import { document_ } from "../store/state";
import { Button, Segmented } from "../ui/Button";
import { HoldButton } from "../ui/HoldButton";
import { NumberField } from "../ui/NumberField";
import { Done } from "../ui/Outcome";
import { Section } from "../ui/Section";
import { aimsFor } from "../vehicle/aiming";
import { WayReasons, WayVerdict } from "./WayVerdict";
import {
  GUIDED,
  action,
  ask,
  flyWay,
  height_m,
  isAtPlace,
  isClockwise,
  laps,
  putAway,
  radius_m,
  setWaySpeed,
  speed_m_s,
  takeAim,
  wantedSpeed_m_s,
  type WayAction,
} from "./guided_orders";

const GOES = [
  { value: "to", label: "Go to", title: "To a place, above the surface there" },
  { value: "height", label: "Height", title: "Straight up or down over its place" },
  { value: "orbit", label: "Orbit", title: "Around a place, looking at it" },
  { value: "look", label: "Look", title: "The nose turns to a place" },
] as const;

const RETURNS = [
  { value: "home", label: "Home", title: "Up, over and to home, and lands" },
  { value: "rally", label: "Rally", title: "To the nearest rally point on board, and lands" },
  { value: "back", label: "Back", title: "Home along the way that was flown, and lands" },
] as const;

const OVER: Partial<Record<WayAction, string>> = {
  to: "Height above the surface there",
  height: "Height above the surface",
  orbit: "Height above the surface there",
  home: "Height above home",
  rally: "Height above the rally point",
  take_off: "Height above home",
};

const TITLES: Record<WayAction, string> = {
  take_off: "Take-off",
  to: "Go to",
  height: "Height",
  look: "Look",
  orbit: "Orbit",
  home: "Home",
  rally: "Rally point",
  back: "Back the way it came",
};

/** A take-off climbs as the vehicle climbs, and a look turns the nose only. */
const hasSpeed = (asked: WayAction) => asked !== "look" && asked !== "take_off";

function Fields({ asked }: { asked: WayAction }) {
  const over = OVER[asked];
  const speed = wantedSpeed_m_s();
  return (
    <div class="field-grid">
      {over && (
        <NumberField
          label={over}
          unit="m"
          {...LIMITS.WayBody.height_m}
          step={1}
          value={height_m.value}
          testid="way-height"
          onChange={(value) => (height_m.value = value)}
        />
      )}
      {asked === "orbit" && (
        <>
          <NumberField
            label="Radius"
            unit="m"
            {...LIMITS.WayBody.radius_m}
            step={1}
            value={radius_m.value}
            testid="way-radius"
            onChange={(value) => (radius_m.value = value)}
          />
          <NumberField
            label="Laps"
            unit=""
            whole
            {...LIMITS.WayBody.laps}
            step={1}
            value={laps.value}
            testid="way-laps"
            onChange={(value) => (laps.value = value)}
          />
        </>
      )}
      {hasSpeed(asked) && speed !== null && (
        <NumberField
          label="Speed"
          unit="m/s"
          {...LIMITS.WayBody.speed_m_s}
          step={0.5}
          value={speed}
          testid="way-speed"
          onChange={(value) => (speed_m_s.value = value)}
        />
      )}
    </div>
  );
}

/** What is wanted: nothing moves before it is judged. */
function Wish() {
  const asked: WayAction = isInAir.value ? action.value : "take_off";
  const isAiming = aimsFor() === "way";
  const hasTerrain = Boolean(document_.value?.terrain_id);
  const why = whyNotCommand.value ?? (hasTerrain ? null : "Open a surface model in Plan first");
  const isBusy = pending.value.has(GUIDED) || guided.value.is_judging;
  const set = (value: WayAction) => (action.value = value);
  return (
    <>
      {isInAir.value && (
        <div class="way-actions">
          <Segmented label="Fly" testid="guided" value={asked} options={GOES} onChange={set} />
          <Segmented label="Return" testid="guided" value={asked} options={RETURNS} onChange={set} />
        </div>
      )}
      <Fields asked={asked} />
      {asked === "orbit" && (
        <Segmented
          label="Direction"
          testid="way-turn"
          value={isClockwise.value ? "clockwise" : "counter"}
          options={[
            { value: "clockwise", label: "Clockwise" },
            { value: "counter", label: "Counter-clockwise" },
          ]}
          onChange={(turn) => (isClockwise.value = turn === "clockwise")}
        />
      )}
      {isAtPlace(asked) ? (
        <Button
          class="wide"
          icon="target"
          pressed={isAiming}
          disabled={why !== null || isBusy}
          title={why ?? "Then click the surface"}
          testid="way-click"
          onClick={takeAim}
        >
          {isAiming ? "Click the surface…" : "Click a place"}
        </Button>
      ) : (
        <Button
          class="wide"
          icon="route"
          disabled={why !== null || isBusy}
          title={why ?? "Lays the way and judges it; nothing moves"}
          testid="way-ask"
          onClick={() => void ask(asked)}
        >
          Show the way
        </Button>
      )}
    </>
  );
}

const VERDICTS = {
  none: "CERTIFIED",
  way: "NOT CERTIFIED",
  return: "RETURN NOT CLEAR",
  others: "VEHICLE IN THE WAY",
} as const;

function Facts({ way }: { way: WayDoc }) {
  return (
    <dl class="manoeuvre-facts">
      <dt>Clear by</dt>
      <dd data-testid="way-clearance">{clearance(way.clearance_m)}</dd>
      <dt>Required</dt>
      <dd>{demanded(way.required_m)}</dd>
      <dt>Length</dt>
      <dd>{metres(way.length_m, 0)}</dd>
      <dt>Takes at least</dt>
      <dd>{withUnit(way.seconds, "s")}</dd>
    </dl>
  );
}

/** The way as it is drawn in the 3D view: to be flown, or why not. */
function Way({ way }: { way: WayDoc }) {
  const why = whyNotCommand.value;
  const isClear = way.problem === null;
  return (
    <div
      class={`way-card ${isClear ? "certified" : "not-certified"}`}
      role="group"
      aria-label="The way"
      data-testid="way-card"
      data-problem={way.problem ?? "none"}
    >
      <WayVerdict icon={isClear ? "check" : "warning"} words={VERDICTS[way.problem ?? "none"]}>
        {TITLES[way.action]}
      </WayVerdict>
      <Facts way={way} />
      {way.notes.map((note) => (
        <p key={note}>{note}</p>
      ))}
      {way.reasons.length > 0 && <WayReasons reasons={way.reasons} testid="way-reasons" />}
      <p class="muted">
        Over {way.terrain_name}
        {way.has_seen ? ", with what was seen" : ""}. It then {way.lands ? "lands" : "holds"}.
      </p>
      {way.flies ? (
        hasSpeed(way.action) && (
          <NumberField
            label="Speed"
            unit="m/s"
            {...LIMITS.WaySpeedBody.speed_m_s}
            max={way.most_m_s}
            step={0.5}
            value={way.speed_m_s}
            disabled={why !== null}
            testid="way-flown-speed"
            onChange={(value) => void setWaySpeed(value)}
          />
        )
      ) : (
        <div class="row wrap">
          {way.problem !== "way" && way.problem !== "others" && (
            <HoldButton
              label={isClear ? "Fly it" : "Fly it all the same"}
              icon="play"
              place={GUIDED}
              disabled={why !== null}
              title={why ?? "From where it is now"}
              testid="way-fly"
              onHold={() => void flyWay(way.id, !isClear)}
            />
          )}
          <Button disabled={why !== null} testid="way-drop" onClick={() => void putAway()}>
            Put away
          </Button>
        </div>
      )}
    </div>
  );
}

function summary(): string {
  const { way, is_judging } = guided.value;
  if (is_judging) return "judging…";
  if (way?.flies) return `flies: ${TITLES[way.action].toLowerCase()}`;
  return way ? VERDICTS[way.problem ?? "none"].toLowerCase() : "";
}

/** One certified way at a time, from where the vehicle is: asked for, looked at, flown. */
export function GuidedSection() {
  if (!adopted.value) return null;
  const { way, is_judging } = guided.value;
  const isPaused = way?.flies && flight.live.value?.phase === "paused";
  return (
    <Section id={GUIDED} title="Guided flight" icon="route" summary={summary()} isUrgent={way !== null}>
      {(!way || isPaused) && <Wish />}
      {is_judging && (
        <p class="working" role="status">
          <span class="spinner" aria-hidden="true" /> Judging the way…
        </p>
      )}
      {way && <Way way={way} />}
      <Done place={GUIDED} />
    </Section>
  );
}
