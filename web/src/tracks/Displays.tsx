import { Polar, type DisplayProps } from "../obstacles/Polar";
import type { Source } from "../store/flying";
import { hasSensors } from "../store/obstacles";
import { hasTracks, isEndangered } from "../store/moving";
import { aroundDisplay } from "../store/prefs";
import { Icon } from "../ui/Icon";
import { matching } from "../ui/media";
import { ROWS, TrackList } from "./TrackList";
import { VelocityDisplay } from "./VelocityDisplay";

/** As in `polar.css`: from this width on Fly has room for both displays at once. */
const isRoomy = matching("(min-width: 1600px)");

/** Only the live instruments have the wide panel. */
export const hasRoom = (source: Source) => isRoomy.value && source === "live";

const TABS = [
  { id: "obstacles", label: "Around" },
  { id: "velocity", label: "Velocities" },
] as const;

/** Of the two: the chosen one, if there is something in it. */
const displayed = (source: Source) => (hasTracks[source].value ? aroundDisplay.value : "obstacles");

/** Which of the two stands at their common place; the mark has its room always. */
function Tabs({ source }: { source: Source }) {
  return (
    <div class="segmented displays" role="group" aria-label="Display" data-testid="displays">
      {TABS.map(({ id, label }) => (
        <button
          type="button"
          key={id}
          aria-pressed={displayed(source) === id}
          disabled={id === "velocity" && !hasTracks[source].value}
          data-testid={`display-${id}`}
          onClick={() => (aroundDisplay.value = id)}
        >
          {label}
          {id === "velocity" && (
            <span class={`tab-mark ${isEndangered[source].value ? "shown" : ""}`}>
              <Icon name="warning" size={16} />
              {isEndangered[source].value && <span class="visually-hidden">: something comes too near</span>}
            </span>
          )}
        </button>
      ))}
    </div>
  );
}

/** What is around, and which velocities lead into it: side by side where there is room, else one at a time. */
export function Displays({ source, state }: DisplayProps) {
  const polar = <Polar source={source} state={state} />;
  // Live their place is kept from the first sensor on: nothing moves when tracks come.
  if (!hasTracks[source].value && (source === "replay" || !hasSensors.live.value)) return polar;
  const velocity = <VelocityDisplay source={source} state={state} />;
  if (hasRoom(source))
    return (
      <>
        {polar}
        {velocity}
        <TrackList source={source} rows={ROWS.wide} />
      </>
    );
  if (!hasSensors[source].value) return velocity;
  return (
    <>
      <Tabs source={source} />
      {displayed(source) === "velocity" ? velocity : polar}
    </>
  );
}
