import type { ComponentChildren } from "preact";
import { DASH, bearing, compassPoint, degreesOf, metres, withUnit } from "../format";
import type { FollowDoc, VehicleState } from "../messages";

interface TileProps {
  label: string;
  title: string;
  value: string;
  testid: string;
  children?: ComponentChildren;
}

function Tile({ label, title, value, testid, children }: TileProps) {
  return (
    <div class="tile" title={title}>
      <dt>{label}</dt>
      <dd data-testid={testid}>
        {value}
        {children}
      </dd>
    </div>
  );
}

const AT_HOME_M = 2;

/** Which way home is: as seen from the nose, so that the arrow shows where to steer. */
function HomeArrow({ follow, state }: { follow: FollowDoc | null; state: VehicleState | null }) {
  const bearing_deg = follow?.home_bearing_deg ?? null;
  // Over home every direction is as good.
  if (bearing_deg === null || (follow?.home_distance_m ?? 0) < AT_HOME_M) return null;
  const heading_deg = state?.heading_rad == null ? 0 : degreesOf(state.heading_rad);
  return (
    <span class="home-arrow" title={`Home bears ${bearing(bearing_deg)}`}>
      <svg viewBox="-10 -10 20 20" width="20" height="20" aria-hidden="true">
        <path d="M0-8l6 14-6-4-6 4z" transform={`rotate(${(bearing_deg - heading_deg).toFixed(0)})`} />
      </svg>
      <span class="muted">{compassPoint(bearing_deg)}</span>
    </span>
  );
}

/** A small distance to the ground in centimetres, a large one in decimetres: always as wide. */
const distance = (value_m: number | null | undefined) =>
  metres(value_m, value_m !== null && value_m !== undefined && Math.abs(value_m) < 10 ? 2 : 1);

/** Speeds, heights with their references, and home. */
export function Tiles(props: { state: VehicleState | null; follow: FollowDoc | null; isOld: boolean }) {
  const { state, follow, isOld } = props;
  return (
    <dl class={`instrument tiles ${isOld ? "old" : ""}`} data-testid="tiles" data-old={isOld}>
      <Tile
        label="Ground speed"
        title="Over the ground"
        value={withUnit(state?.ground_speed_m_s, "m/s", 1)}
        testid="ground-speed"
      />
      <Tile
        label="Climb"
        title="Upwards positive"
        value={withUnit(state?.climb_m_s, "m/s", 1)}
        testid="climb"
      />
      <Tile
        label="Above home"
        title="Height above home, as the vehicle says"
        value={metres(state?.alt_rel_home_m)}
        testid="above-home"
      />
      <Tile
        label="Above DSM"
        title="Height above the surface model, straight below"
        value={distance(follow?.height_above_dsm_m)}
        testid="above-dsm"
      />
      <Tile
        label="To DSM"
        title="Distance in space to the nearest part of the surface model"
        value={distance(follow?.distance_to_dsm_m)}
        testid="to-dsm"
      />
      <Tile
        label="To home"
        title="Horizontal distance; the arrow shows where home is from the nose"
        value={follow?.home_distance_m == null ? DASH : metres(follow.home_distance_m, 0)}
        testid="to-home"
      >
        <HomeArrow follow={follow} state={state} />
      </Tile>
    </dl>
  );
}
