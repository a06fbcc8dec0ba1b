import { RADIUS } from "../obstacles/polar";
import type { VelocityCone } from "../messages";
import { conePath, conePlace, leadsInto, tipOf, velocityPlace, type Scale, type Velocity } from "./velocity";
import { trackName } from "./track_words";

/** What the velocity display draws, from below to above. */

export const CLIP = "velocity-disc";

/** The vehicle flies no faster than this. */
export function LimitRing({ limit_m_s, rim_m_s }: { limit_m_s: number; rim_m_s: number }) {
  if (limit_m_s <= 0) return null;
  return <circle class="velocity-limit" r={(Math.min(1, limit_m_s / rim_m_s) * RADIUS).toFixed(1)} />;
}

interface ConesProps {
  cones: readonly VelocityCone[];
  own: Velocity | null;
  scale: Scale;
}

export function Cones({ cones, own, scale }: ConesProps) {
  const isHit = (cone: VelocityCone) => own !== null && leadsInto(cone, own);
  // What the vehicle flies into lies on top.
  const all = [...cones].sort((a, b) => Number(isHit(a)) - Number(isHit(b)));
  return (
    <g clip-path={`url(#${CLIP})`}>
      {all.map((cone) => (
        <path
          key={cone.track_id}
          class={`velocity-cone ${isHit(cone) ? "hit" : ""}`}
          d={conePath(cone, scale)}
        />
      ))}
    </g>
  );
}

/** Each object's own velocity, where its cone begins, and its number. */
export function ConeNames({ cones, scale }: { cones: readonly VelocityCone[]; scale: Scale }) {
  return (
    <g class="velocity-names">
      {cones.map((cone) => {
        const apex = velocityPlace(cone.apex_enu_m_s, scale);
        const name = conePlace(cone, scale);
        const isInside = Math.hypot(apex.x, apex.y) <= RADIUS;
        return (
          <g key={cone.track_id}>
            {isInside && <circle cx={apex.x.toFixed(1)} cy={apex.y.toFixed(1)} r={3.5} />}
            {name && (
              <text x={name.x.toFixed(1)} y={(name.y + 5).toFixed(1)}>
                {trackName(cone.track_id)}
              </text>
            )}
          </g>
        );
      })}
    </g>
  );
}

const HEAD = "M0-1 5.5 11 0 8-5.5 11z";

function Arrow({ velocity, scale, kind }: { velocity: Velocity; scale: Scale; kind: "now" | "proposed" }) {
  const { x, y, off_nose_deg, isBeyond } = tipOf(velocity, scale);
  const isStill = Math.hypot(x, y) < 3;
  return (
    <g class={`velocity-${kind}`} data-beyond={isBeyond}>
      {isStill ? (
        <circle r={5} />
      ) : (
        <>
          <path class="shaft" d={`M0 0L${x.toFixed(1)} ${y.toFixed(1)}`} />
          <path
            class="head"
            d={HEAD}
            transform={`translate(${x.toFixed(1)} ${y.toFixed(1)}) rotate(${off_nose_deg.toFixed(1)})`}
          />
        </>
      )}
    </g>
  );
}

export const Now = (props: { velocity: Velocity; scale: Scale }) => <Arrow kind="now" {...props} />;

/** Dashed, and with a ring around its tip: told from the present velocity without its colour. */
export function Proposed({ velocity, scale }: { velocity: Velocity; scale: Scale }) {
  const { x, y } = tipOf(velocity, scale);
  return (
    <>
      <Arrow kind="proposed" velocity={velocity} scale={scale} />
      <circle class="velocity-proposed-ring" cx={x.toFixed(1)} cy={y.toFixed(1)} r={9} />
    </>
  );
}
