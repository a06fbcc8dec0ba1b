import { withUnit } from "../format";
import { age_s, type Group } from "../store/ages";
import { now_ms } from "../store/clock";
import { heard, linkState, silence_s, type Source } from "../store/flying";
import { failed, isOld, late_s, unheard_s } from "../store/reach";
import { link } from "../store/state";
import { Displays } from "../tracks/Displays";
import { Icon } from "../ui/Icon";
import { Attitude } from "./Attitude";
import { Following } from "./Following";
import { Supplies } from "./Supplies";
import { Tiles } from "./Tiles";

/** "3 s old" for what is greyed, nothing for what is fresh. */
function ageOf(source: Source, group: Group): { isOld: boolean; age: string } {
  const old = isOld(source, group);
  const seconds = age_s(heard[source].value, group, now_ms.value);
  return { isOld: old, age: old && seconds !== null ? `${withUnit(Math.floor(seconds), "s")} old` : "" };
}

const isLost = () => failed.value !== null || late_s.value !== null || linkState.value === "lost";

function lostWords(): [what: string, then: string] {
  if (link.value === "silent")
    return ["The server is silent", "Nothing below is new. Take the pilot's transmitter."];
  if (failed.value === "server")
    return ["This page has lost the server", "It keeps trying. Take the pilot's transmitter."];
  if (failed.value === "link")
    return ["The link has failed", "It is started again. Take the pilot's transmitter."];
  if (late_s.value !== null)
    return ["This page is late", "The line is slow: what it shows has passed. Take the pilot's transmitter."];
  return ["Communication lost", "Last values below. The vehicle follows its failsafe."];
}

/** Over the attitude, so that nothing moves: the values below stay, greyed. */
function Lost() {
  const [what, then] = lostWords();
  const seconds = failed.value === null ? (late_s.value ?? silence_s.value) : unheard_s.value;
  return (
    <div class="lost-notice" role="alert" data-testid="link-lost">
      <Icon name="warning" size={28} />
      <strong>{what}</strong>
      {seconds !== null && <span class="lost-seconds">{withUnit(Math.floor(seconds), "s")}</span>}
      <span>{then}</span>
    </div>
  );
}

/** The same instruments for the vehicle and for a recording. */
export function Instruments({ source }: { source: Source }) {
  const message = heard[source].value?.message ?? null;
  const state = message?.state ?? null;
  const follow = message?.follow ?? null;
  const lost = source === "live" && isLost();
  const [attitude, position] = [ageOf(source, "attitude"), ageOf(source, "position")];
  return (
    <div class="instruments" data-testid={`instruments-${source}`}>
      <div class="around">
        <div class="attitude-holder">
          <Attitude state={state} isOld={attitude.isOld} />
          {lost && <Lost />}
          {position.age && !lost && <span class="age position-age">{position.age}</span>}
        </div>
        <Displays source={source} state={state} />
      </div>
      <Tiles state={state} follow={follow} isOld={position.isOld} />
      <Following source={source} state={state} follow={follow} isOld={position.isOld} />
      <Supplies state={state} battery={ageOf(source, "battery")} gnss={ageOf(source, "gnss")} />
    </div>
  );
}
