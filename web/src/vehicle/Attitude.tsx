import { bearing, degreesOf } from "../format";
import type { VehicleState } from "../messages";
import { HALF_HEIGHT, HALF_WIDTH, ROLL_MARKS_DEG, horizon, ladder, tape } from "./attitude";

const FAR = 400;
const ROLL_RADIUS = 58;
const TAPE_HEIGHT = 24;
const AIRCRAFT = "M-56 0h32v7M56 0H24v7M-1 0h2";
const RUNGS = ladder();

function World({ roll_rad, pitch_rad }: { roll_rad: number; pitch_rad: number }) {
  const { turn_deg, down } = horizon(roll_rad, pitch_rad);
  return (
    <g transform={`rotate(${turn_deg.toFixed(2)})`}>
      <g transform={`translate(0 ${down.toFixed(2)})`}>
        <rect class="sky" x={-FAR} y={-FAR} width={2 * FAR} height={FAR} />
        <rect class="earth" x={-FAR} y={0} width={2 * FAR} height={FAR} />
        <path class="horizon" d={`M${-FAR} 0H${FAR}`} />
        {RUNGS.map((rung) => (
          <g key={rung.pitch_deg}>
            <path class="rung" d={`M${-rung.halfWidth} ${rung.y}H${rung.halfWidth}`} />
            {rung.label && (
              <text class="rung-label" x={rung.halfWidth + 5} y={rung.y + 4.5}>
                {rung.label}
              </text>
            )}
          </g>
        ))}
      </g>
      <path class="roll-pointer" d={`M0 ${-ROLL_RADIUS + 1}l-5 9h10z`} />
    </g>
  );
}

function RollScale() {
  return (
    <g class="roll-scale">
      {ROLL_MARKS_DEG.map((mark) => (
        <path
          key={mark}
          d={`M0 ${-ROLL_RADIUS}v${mark % 30 === 0 ? -8 : -5}`}
          transform={`rotate(${mark})`}
        />
      ))}
    </g>
  );
}

function HeadingTape({ heading_rad }: { heading_rad: number }) {
  const heading_deg = degreesOf(heading_rad);
  return (
    <g transform={`translate(0 ${HALF_HEIGHT})`}>
      <rect class="tape" x={-HALF_WIDTH} y={0} width={2 * HALF_WIDTH} height={TAPE_HEIGHT} />
      {tape(heading_deg).map((mark) => (
        <g key={mark.x.toFixed(1)}>
          <path class="tape-mark" d={`M${mark.x.toFixed(1)} 0v${mark.label ? 4 : 6}`} />
          {mark.label && (
            <text class="tape-label" x={mark.x.toFixed(1)} y={18}>
              {mark.label}
            </text>
          )}
        </g>
      ))}
      <rect class="tape-box" x={-24} y={1} width={48} height={TAPE_HEIGHT - 2} rx={3} />
      <text class="tape-now" x={0} y={18}>
        {bearing(heading_deg)}
      </text>
    </g>
  );
}

const words = (roll_deg: number, pitch_deg: number) =>
  `${Math.abs(Math.round(roll_deg))}° ${roll_deg < 0 ? "left" : "right"}, nose ${Math.abs(Math.round(pitch_deg))}° ${
    pitch_deg < 0 ? "down" : "up"
  }`;

/** Sky over earth as seen from the vehicle. Without a known attitude there is no horizon to be misled by. */
export function Attitude({ state, isOld }: { state: VehicleState | null; isOld: boolean }) {
  const { roll_rad = null, pitch_rad = null, heading_rad = null } = state ?? {};
  const isKnown = roll_rad !== null && pitch_rad !== null;
  const label = isKnown
    ? `Attitude: ${words(degreesOf(roll_rad), degreesOf(pitch_rad))}, heading ${bearing(degreesOf(heading_rad ?? 0))}`
    : "Attitude: not known";
  return (
    <svg
      class={`attitude ${isOld ? "old" : ""}`}
      viewBox={`${-HALF_WIDTH} ${-HALF_HEIGHT} ${2 * HALF_WIDTH} ${2 * HALF_HEIGHT + TAPE_HEIGHT}`}
      role="img"
      aria-label={label}
      data-testid="attitude"
      data-old={isOld}
    >
      <clipPath id="attitude-window">
        <rect x={-HALF_WIDTH} y={-HALF_HEIGHT} width={2 * HALF_WIDTH} height={2 * HALF_HEIGHT} />
      </clipPath>
      <g clip-path="url(#attitude-window)">
        {isKnown ? (
          <World roll_rad={roll_rad} pitch_rad={pitch_rad} />
        ) : (
          <>
            <rect
              class="nowhere"
              x={-HALF_WIDTH}
              y={-HALF_HEIGHT}
              width={2 * HALF_WIDTH}
              height={2 * HALF_HEIGHT}
            />
            <text class="unknown-attitude" x={0} y={34}>
              No attitude
            </text>
          </>
        )}
        <RollScale />
        <path class="aircraft" d={AIRCRAFT} />
        <path class="aircraft-line" d={AIRCRAFT} />
      </g>
      {heading_rad !== null && <HeadingTape heading_rad={heading_rad} />}
    </svg>
  );
}
