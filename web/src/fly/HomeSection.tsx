import { useEffect, useRef } from "preact/hooks";
import { clearance, duration, metres } from "../format";
import type { HomeAskedDoc, ReturnDoc } from "../messages";
import { now_ms } from "../store/clock";
import { adopted, isInAir } from "../store/flying";
import { home } from "../store/home";
import { pending } from "../store/outcomes";
import { whyNotCommand } from "../store/reach";
import { document_ } from "../store/state";
import { Button } from "../ui/Button";
import { HoldButton } from "../ui/HoldButton";
import { Done } from "../ui/Outcome";
import { Section } from "../ui/Section";
import { aimsFor } from "../vehicle/aiming";
import { HOME, aimAtHome, askHome, putHomeAway, setHome, takeAnswer } from "../vehicle/home_orders";
import { returnAge_s, returnWords } from "../vehicle/return_words";
import { WayReasons, WayVerdict } from "./WayVerdict";

/** The vehicle's own return: clear by how much, or what is in the way. */
function Return({ ret, isAnew = false }: { ret: ReturnDoc; isAnew?: boolean }) {
  const age_s = returnAge_s(ret, now_ms.value);
  const isClear = ret.state === "certified";
  return (
    <div
      class={`way-card ${isClear ? "certified" : "not-certified"}`}
      data-testid="return-verdict"
      data-state={ret.state}
    >
      <WayVerdict icon={isClear ? "check" : "warning"} words={returnWords(ret.state)}>
        {isAnew ? "judging…" : age_s === null ? "" : `${duration(age_s)} ago`}
      </WayVerdict>
      {isClear ? <p>Clear by {clearance(ret.clearance_m ?? null)}.</p> : <WayReasons reasons={ret.reasons} />}
      {ret.instead && <p>A way home is certified: Guided flight, Home.</p>}
      {ret.notes.map((note) => (
        <p key={note}>{note}</p>
      ))}
    </div>
  );
}

function Asked({ asked }: { asked: HomeAskedDoc }) {
  const why = whyNotCommand.value;
  const card = useRef<HTMLDivElement>(null);
  useEffect(() => {
    if (!takeAnswer()) return;
    card.current?.scrollIntoView({ block: "nearest" });
    // However long the judgement is, what is pressed next is in sight.
    card.current?.lastElementChild?.scrollIntoView({ block: "nearest" });
  }, [asked.id]);
  const rises_m = Math.abs(asked.rises_m);
  const height =
    rises_m < 0.05 ? "as high" : `${metres(rises_m, 1)} ${asked.rises_m > 0 ? "higher" : "lower"}`;
  return (
    <div ref={card} class="way-card home-card" role="group" aria-label="Home" data-testid="home-card">
      <WayVerdict icon="home" words={asked.is_here ? "Home here" : "Home there"}>
        {metres(asked.moves_m, 0)} from home, {height}
      </WayVerdict>
      {asked.changes.map((change) => (
        <p key={change}>{change}</p>
      ))}
      {asked.ret && <Return ret={asked.ret} />}
      <div class="row wrap">
        <HoldButton
          label={asked.is_here ? "Set home here" : "Set home there"}
          icon="home"
          place={HOME}
          disabled={why !== null}
          title={why ?? "Return then leads there"}
          testid="home-set"
          onHold={() => void setHome(asked.id)}
        />
        <Button disabled={why !== null} testid="home-drop" onClick={() => void putHomeAway()}>
          Put away
        </Button>
      </div>
    </div>
  );
}

function Ask() {
  const hasTerrain = Boolean(document_.value?.terrain_id);
  const why = whyNotCommand.value ?? (hasTerrain ? null : "Open a surface model in Plan first");
  const isBusy = pending.value.has(HOME) || home.value.is_judging;
  const isAiming = aimsFor() === "home";
  return (
    <div class="row wrap">
      <Button
        icon="drone"
        disabled={why !== null || isBusy}
        title={why ?? "Where the vehicle is, on the ground below it; nothing is set yet"}
        testid="home-here"
        onClick={() => void askHome()}
      >
        Home here…
      </Button>
      <Button
        icon="target"
        pressed={isAiming}
        disabled={why !== null || isBusy || !isInAir.value}
        title={why ?? (isInAir.value ? "Then click the surface; nothing is set yet" : "In the air only")}
        testid="home-there"
        onClick={aimAtHome}
      >
        {isAiming ? "Click the surface…" : "Home there…"}
      </Button>
    </div>
  );
}

function summary(): string {
  const { asked, is_judging, is_judging_return, ret } = home.value;
  if (is_judging || (is_judging_return && !ret)) return "judging…";
  if (asked) return asked.is_here ? "here?" : "there?";
  return ret ? returnWords(ret.state).toLowerCase() : "";
}

/** Home as it may be set by order, and what Return is worth since it was moved. */
export function HomeSection() {
  if (!adopted.value) return null;
  const { asked, is_judging, ret, is_judging_return } = home.value;
  return (
    <Section id={HOME} title="Home" icon="home" summary={summary()} isUrgent={asked !== null || ret !== null}>
      {ret && !asked && <Return ret={ret} isAnew={is_judging_return} />}
      {asked ? <Asked asked={asked} /> : <Ask />}
      {is_judging && (
        <p class="working" role="status">
          <span class="spinner" aria-hidden="true" /> Judging home…
        </p>
      )}
      <Done place={HOME} />
    </Section>
  );
}
