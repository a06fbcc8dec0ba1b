import { DASH, degreesOf } from "../format";
import type { TracksStatus } from "../messages";
import type { DisplayProps } from "../obstacles/Polar";
import { HALF_HEIGHT, HALF_WIDTH, North, Rings } from "../obstacles/PolarLayers";
import { RADIUS } from "../obstacles/polar";
import { now_ms } from "../store/clock";
import { movingWatch, moving } from "../store/moving";
import { CLIP, ConeNames, Cones, LimitRing, Now, Proposed } from "./VelocityLayers";
import { rimOf, speed_m_s, speedRings } from "./velocity";
import { displayWords, headline, speed } from "./track_words";

type ArrowKind = "now" | "proposed";

/** A speed, and the arrow that stands for it. */
function Corner({ kind, word, value }: { kind: ArrowKind; word: string; value: string }) {
  return (
    <div class={`velocity-corner ${kind}`} data-testid={`velocity-${kind}`}>
      <span class="muted">
        <svg class={`velocity-key ${kind}`} viewBox="0 0 20 12" aria-hidden="true">
          <path d="M1 6H14" />
          <path class="head" d="M12 1.5 19 6l-7 4.5z" />
        </svg>
        {word}
      </span>
      <strong>{value}</strong>
    </div>
  );
}

function Keys() {
  return (
    <ul class="polar-keys" aria-hidden="true">
      <li>
        <svg class="velocity-key" viewBox="0 0 20 12">
          <path class="key-cone" d="M2 6 18 1V11z" />
        </svg>
        Collides
      </li>
      <li>
        <svg class="velocity-key" viewBox="0 0 20 12">
          <path class="key-limit" d="M1 11A16 16 0 0 1 19 11" />
        </svg>
        Limit
      </li>
    </ul>
  );
}

const speedOf = (velocity: TracksStatus["velocity_enu_m_s"]) =>
  velocity === null ? DASH : speed(speed_m_s(velocity));

/**
 * All velocities that the vehicle could have, the nose up: those that lead into a moving object, the one that it has,
 * and the nearest one that leads into nothing.
 */
export function VelocityDisplay({ source, state }: DisplayProps) {
  const known = moving[source].value;
  if (!known) return null;
  const { status } = known;
  const watch = movingWatch(known, source === "live", now_ms.value);
  const heading_deg = state?.heading_rad != null ? degreesOf(state.heading_rad) : null;
  const own = status.velocity_enu_m_s;
  const scale = { rim_m_s: rimOf(status.max_speed_m_s, own), heading_deg: heading_deg ?? 0 };
  const { proposal } = status;
  const large = headline(status, watch);
  const isOld = watch !== "running";
  return (
    <div class={`polar-holder velocity-holder ${isOld ? "old" : ""}`}>
      <svg
        class="polar velocity"
        viewBox={`${-HALF_WIDTH} ${-HALF_HEIGHT} ${2 * HALF_WIDTH} ${2 * HALF_HEIGHT}`}
        role="img"
        aria-label={displayWords(status, watch, heading_deg)}
        data-testid="velocity"
        data-state={watch}
        data-cones={status.cones.length}
        data-rim={scale.rim_m_s}
      >
        <clipPath id={CLIP}>
          <circle r={RADIUS} />
        </clipPath>
        <Cones cones={status.cones} own={own} scale={scale} />
        <Rings values={speedRings(scale.rim_m_s)} unit="m/s" />
        <LimitRing limit_m_s={status.max_speed_m_s} rim_m_s={scale.rim_m_s} />
        <North heading_rad={state?.heading_rad ?? 0} />
        <ConeNames cones={status.cones} scale={scale} />
        {proposal && <Proposed velocity={proposal.velocity_enu_m_s} scale={scale} />}
        {own && <Now velocity={own} scale={scale} />}
        {large && (
          <text class={`polar-blind ${status.no_proposal && !isOld ? "no-way" : ""}`} y={46}>
            {large}
          </text>
        )}
      </svg>
      <Corner kind="now" word="Now" value={isOld ? DASH : speedOf(own)} />
      <Corner
        kind="proposed"
        word="Proposed"
        value={proposal && !isOld ? speedOf(proposal.velocity_enu_m_s) : DASH}
      />
      <Keys />
    </div>
  );
}
