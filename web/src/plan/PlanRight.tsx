import { Changes } from "../ui/Changes";
import { useEffect, useState } from "preact/hooks";
import { age, count, duration, latLon, length, metres, number, percent } from "../format";
import type { ResultDoc } from "../messages";
import { edit } from "../store/plan";
import { Bar } from "../ui/Bar";
import { Button } from "../ui/Button";
import { ErrorPanel } from "../ui/Outcome";
import { Icon } from "../ui/Icon";
import { OtherSurface } from "../ui/OtherSurface";
import { computation, isFresh, known, result } from "../store/state";
import { Clearance } from "./Clearance";
import { Photos } from "./Photos";
import { SeesEnough } from "./SeesEnough";
import { verdict, VerdictShape, verdictWord } from "./Verdict";

/** "Computed 12 s ago", counting by itself. */
function Age() {
  const [, tick] = useState(0);
  useEffect(() => {
    const timer = setInterval(() => tick((n) => n + 1), 1000);
    return () => clearInterval(timer);
  }, []);
  const at_ms = known.value?.at_ms;
  if (at_ms === undefined) return null;
  const text = age(Date.now() - at_ms);
  const ago = text === "now" ? "just now" : `${text} ago`;
  return <span class="muted">{isFresh.value ? `Computed ${ago}` : `Older figures, ${ago}`}</span>;
}

function Headline() {
  const kind = verdict();
  const hint = computation.value?.state === "empty" ? computation.value.hint : "";
  return (
    <div class={`verdict ${kind}`} data-testid="verdict" data-verdict={kind} role="status" aria-live="polite">
      <VerdictShape kind={kind} size={40} />
      <div>
        <strong>{verdictWord(kind)}</strong>
        <span class="verdict-note">{hint || <Age />}</span>
      </div>
    </div>
  );
}

/** A certificate against more than the surface model says so. */
function AgainstSeen({ result: { seen_columns: columns } }: { result: ResultDoc }) {
  if (columns === 0) return null;
  return (
    <p class="against-seen" data-testid="against-seen">
      <Icon name="radar" size={16} /> Against the surface model and {count(columns, "seen column")}
    </p>
  );
}

/** The points came from a mission over another surface model, or the plan was given another one. */
function FromAnotherModel({ result: { other_surface: text } }: { result: ResultDoc }) {
  const settle = () => edit("Plan on this surface model", "terrain", (doc) => ({ ...doc, planned_on: null }));
  return (
    <OtherSurface text={text}>
      <Changes>
        <Button testid="settle-surface" title="The points are meant for this surface model" onClick={settle}>
          Plan on this one
        </Button>
      </Changes>
    </OtherSurface>
  );
}

const OF_HOME = new Set(["home_column", "home_on_top", "home_drop"]);

/** One press puts home where it would do. */
function MoveHome({ result: { home } }: { result: ResultDoc }) {
  const better = home?.better;
  if (!better) return null;
  const { lat_deg, lon_deg } = better;
  const move = () => edit("Move home", "points", (doc) => ({ ...doc, home: { lat_deg, lon_deg } }));
  return (
    <Button
      icon="home"
      testid="move-home"
      title={`${metres(better.away_m)} away, at ${latLon(better)}`}
      onClick={move}
    >
      {better.does ? "Move home there" : "Move home there anyway"}
    </Button>
  );
}

/** Why it is not certified, and why the vehicle cannot fly it. */
function Reasons({ result }: { result: ResultDoc }) {
  const { reasons, feasibility } = result;
  const all = [...reasons, ...(feasibility ?? []).filter((row) => row.state === "fails")];
  if (all.length === 0) return null;
  return (
    <ul class="reasons" data-testid="reasons">
      {all.map((reason) => (
        <li key={reason.code + reason.text} data-code={reason.code}>
          <Icon name="cross" />
          <div>
            <p>{reason.text}</p>
            {reason.mend && <p class="mend">{reason.mend}</p>}
            {OF_HOME.has(reason.code) && (
              <Changes>
                <MoveHome result={result} />
              </Changes>
            )}
          </div>
        </li>
      ))}
    </ul>
  );
}

const fill = (share: number) => (share > 1 ? "bad" : share > 0.9 ? "near" : "neutral");

function Flight({ result }: { result: ResultDoc }) {
  const share = result.duration_s / result.endurance_s;
  const usable = result.usable_endurance_s / result.endurance_s;
  const items = result.items / result.max_items;
  return (
    <section class="facts">
      <h2>Flight</h2>
      <dl>
        <dt>Length</dt>
        <dd data-testid="length">{length(result.length_m)}</dd>
        <dt>Duration</dt>
        <dd data-testid="duration">{duration(result.duration_s)}</dd>
      </dl>
      <Bar
        label="Duration against endurance"
        share={share}
        mark={usable}
        level={fill(result.duration_s / result.usable_endurance_s)}
      />
      <p class="bar-note">
        of {duration(result.usable_endurance_s)} usable · {percent(1 - usable)} reserve
      </p>
      <dl>
        <dt>Mission items</dt>
        <dd data-testid="items">
          {number(result.items)} <span class="muted">of {number(result.max_items)}</span>
        </dd>
      </dl>
      <Bar label="Mission items against the vehicle's limit" share={items} level={fill(items)} />
      <p class="bar-note">
        {count(result.waypoints, "waypoint")} · {metres(result.excess_height_m)} excess height
      </p>
      {result.gsd_min_cm !== null && !result.survey && (
        <dl>
          <dt>Ground sampling</dt>
          <dd data-testid="gsd">
            {number(result.gsd_min_cm, 2)} to {number(result.gsd_max_cm, 2)} cm
          </dd>
        </dl>
      )}
    </section>
  );
}

function Warnings({ result: { warnings } }: { result: ResultDoc }) {
  if (warnings.length === 0) return null;
  return (
    <section class="facts">
      <h2>Please note</h2>
      <ul class="warnings">
        {warnings.map((warning) => (
          <li key={warning}>
            <Icon name="warning" />
            <span>{warning}</span>
          </li>
        ))}
      </ul>
    </section>
  );
}

/** What is true about the plan. Old figures stay in place, greyed, while new ones are computed. */
export function PlanRight() {
  const now = computation.value;
  const shown = result.value;
  return (
    <div class="panel-scroll truth" tabIndex={0}>
      {shown && <FromAnotherModel result={shown} />}
      <Headline />
      {now?.state === "error" && now.error && <ErrorPanel error={now.error} />}
      {shown ? (
        <div class={`figures ${isFresh.value ? "" : "stale"}`} aria-busy={!isFresh.value}>
          <AgainstSeen result={shown} />
          <Reasons result={shown} />
          <SeesEnough />
          <Clearance result={shown} />
          <Flight result={shown} />
          <Photos survey={shown.survey} />
          <Warnings result={shown} />
        </div>
      ) : (
        now?.state !== "error" && <Teaching />
      )}
    </div>
  );
}

function Teaching() {
  return (
    <div class="teaching">
      <p>
        The certificate states the smallest distance between the line that will be flown and the surface
        model.
      </p>
      <p>It appears here as soon as there is a terrain and at least two points.</p>
    </div>
  );
}
