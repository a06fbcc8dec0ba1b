import { clearance, count, demanded, latLon, metres } from "../format";
import type { ResultDoc } from "../messages";
import { Button } from "../ui/Button";
import { Icon } from "../ui/Icon";
import { drawer } from "../store/view";
import { frame } from "../store/stream";
import { CopyPlace } from "../ui/CopyPlace";

type Level = "good" | "near" | "bad" | "neutral";

const MARKS = { good: "check", near: "warning", bad: "cross", neutral: null } as const;

/** One figure with its verdict as sign and colour. */
function Figure(props: { label: string; value: string; level?: Level; note?: string; testid?: string }) {
  const { level = "neutral" } = props;
  const mark = MARKS[level];
  return (
    <div class={`figure ${level}`}>
      <dt>{props.label}</dt>
      <dd data-testid={props.testid}>
        {mark && <Icon name={mark} size={16} />}
        {props.value}
        {props.note && <span class="muted"> {props.note}</span>}
      </dd>
    </div>
  );
}

/** Inside or touching is red, below the requirement orange. */
export function clearanceLevel(distance_m: number | null, required_m: number): Level {
  if (distance_m === null) return "bad";
  if (distance_m <= 0) return "bad";
  return distance_m < required_m ? "near" : "good";
}

/** Zero is no height to climb to: the way home is clear at whatever height the vehicle has. */
function neededWords(needed_m: number | null): string {
  if (needed_m === null) return "none is safe";
  return needed_m > 0 ? metres(needed_m) : "any";
}

/** On narrow screens the drawer would cover what is shown. */
function showWorst(): void {
  drawer.value = null;
  frame("worst");
}

function Worst({ result }: { result: ResultDoc }) {
  const { worst } = result;
  if (!worst) return null;
  return (
    <div class="worst">
      <span class="row">
        <span class="muted">Nearest place, leg {worst.leg + 1}</span>
        <Button icon="target" testid="show-worst" title="Show it in the 3D view" onClick={showWorst}>
          Show
        </Button>
      </span>
      <span class="row place">
        {latLon(worst)}
        <CopyPlace place={worst} name="the nearest place" />
      </span>
      <span>{metres(worst.alt_rel_home_m)} above home</span>
    </div>
  );
}

const PARTS = { line: "the line", home: "a way home", rally: "a way to a rally point" } as const;

/** How near the flight comes to what the fence forbids. */
function Fence({ verdict, detours }: { verdict: ResultDoc["fence"]; detours: ResultDoc["detours"] }) {
  if (!verdict) return null;
  const { min_distance_m, shape, part, margin_m } = verdict;
  const level = verdict.keeps ? "good" : "bad";
  return (
    <>
      <h2>Fence</h2>
      <dl class="figures-list">
        <Figure
          label="The flight"
          value={verdict.keeps ? "keeps inside" : "does not keep inside"}
          level={level}
          testid="fence-kept"
        />
        {min_distance_m !== null && (
          <Figure
            label={`Nearest: ${PARTS[part]}, ${shape}`}
            value={clearance(min_distance_m)}
            level={clearanceLevel(min_distance_m, margin_m)}
            note={`of ${demanded(margin_m)}`}
            testid="fence-distance"
          />
        )}
        {[...new Set(detours.map((each) => each.shape))].map((around) => (
          <Figure
            key={around}
            label={`Laid around ${around}`}
            value={count(detours.filter((each) => each.shape === around).length, "point")}
            testid="fence-around"
          />
        ))}
      </dl>
      {min_distance_m !== null && (
        <p class="row place">
          {latLon(verdict)}
          <CopyPlace place={verdict} name="the place nearest to the fence" />
        </p>
      )}
    </>
  );
}

function Return({ result }: { result: ResultDoc }) {
  const needed = result.rtl_height_needed_m;
  const isHighEnough = needed !== null && result.rtl_height_m >= needed;
  return (
    <dl class="figures-list">
      <Figure
        label="Return height needed"
        value={neededWords(needed)}
        level={isHighEnough ? "good" : "bad"}
        testid="rtl-needed"
      />
      <Figure label="Return height set" value={metres(result.rtl_height_m)} testid="rtl-set" />
      <Figure
        label="Column over home"
        value={result.home_column_clear ? "clear" : "blocked"}
        level={result.home_column_clear ? "good" : "bad"}
      />
      {result.home && (
        <>
          <Figure
            label="Ground at home may be lower by"
            value={result.home.drop_m === null ? "unknown" : metres(result.home.drop_m, 2)}
            testid="home-drop"
          />
          <Figure
            label="Smallest distance from there"
            value={result.home.min_distance_m === null ? "unknown" : clearance(result.home.min_distance_m)}
            level={clearanceLevel(result.home.min_distance_m, result.required_clearance_m)}
            testid="home-distance"
          />
        </>
      )}
      <Figure label="Highest above ground" value={metres(result.max_height_above_ground_m)} />
    </dl>
  );
}

export function Clearance({ result }: { result: ResultDoc }) {
  const level = clearanceLevel(result.min_distance_m, result.required_clearance_m);
  return (
    <section class="facts">
      <h2>Clearance</h2>
      <div class={`big-figure ${level}`}>
        <span class="value" data-testid="min-distance">
          {clearance(result.min_distance_m)}
        </span>
        <span class="muted">smallest distance</span>
        <span class="required" data-testid="required-clearance">
          {demanded(result.required_clearance_m)} required
        </span>
      </div>
      <dl class="figures-list">
        <Figure
          label="Smallest height above"
          value={clearance(result.min_vertical_m)}
          testid="min-vertical"
        />
      </dl>
      {result.tube && result.tube.radius_m > 0 && (
        <p class="tube" data-testid="tube">
          {result.tube.statement}
        </p>
      )}
      <Worst result={result} />
      <Fence verdict={result.fence} detours={result.detours} />
      <h2>Return and home</h2>
      <Return result={result} />
    </section>
  );
}
