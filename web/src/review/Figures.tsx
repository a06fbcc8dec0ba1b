import { Changes } from "../ui/Changes";
import { DASH, clearance, demanded, deviation, duration, metres, timecode, withUnit } from "../format";
import type { ReviewDoc, ReviewFigures } from "../messages";
import { Icon, type IconName } from "../ui/Icon";
import { seek } from "../store/review";
import { flownLevel, higherWords, type Level } from "./judged";

const MARKS: Record<Level, IconName | null> = { good: "check", near: "warning", bad: "cross", neutral: null };

function Figure(props: { label: string; value: string; level?: Level; testid?: string }) {
  const { label, value, level = "neutral", testid } = props;
  const mark = MARKS[level];
  return (
    <div class={`figure ${level}`}>
      <dt>{label}</dt>
      <dd data-testid={testid}>
        {mark && <Icon name={mark} size={16} />}
        {value}
      </dd>
    </div>
  );
}

function Distance({ figures }: { figures: ReviewFigures }) {
  const { min_distance_m, certified_distance_m, min_distance_t_s } = figures;
  const required_m = figures.required_distance_m ?? null;
  const level = flownLevel(min_distance_m, certified_distance_m, required_m);
  return (
    <>
      {figures.below_required && (
        <p class="below-required" role="alert" data-testid="below-required">
          <Icon name="warning" size={20} />
          <span>
            <strong>Below the required clearance</strong> {figures.below_required}
          </span>
        </p>
      )}
      <div class={`big-figure ${level}`}>
        <span class="value" data-testid="flown-distance">
          {clearance(min_distance_m)}
        </span>
        <span class="muted">smallest distance flown</span>
        <span class="required">
          {certified_distance_m === null ? "none certified" : `${clearance(certified_distance_m)} certified`}
          {required_m !== null && `, ${demanded(required_m)} required`}
        </span>
      </div>
      {min_distance_t_s !== null && (
        <Changes>
          <button
            type="button"
            class="link"
            data-testid="seek-nearest"
            onClick={() => seek(Math.max(0, min_distance_t_s))}
          >
            Go to it, at {timecode(min_distance_t_s)}
          </button>
        </Changes>
      )}
    </>
  );
}

/** Max, mean and 95th percentile of the two deviations. */
function Deviations({ figures }: { figures: ReviewFigures }) {
  const rows = [
    ["Maximum", figures.cross_track_max_m, figures.height_error_max_m, "max"],
    ["Mean", figures.cross_track_mean_m, figures.height_error_mean_m, "mean"],
    ["95 % below", figures.cross_track_p95_m, figures.height_error_p95_m, "p95"],
  ] as const;
  return (
    <table class="deviations" data-testid="deviations">
      <thead>
        <tr>
          <th />
          <th scope="col">Cross-track</th>
          <th scope="col">Height</th>
        </tr>
      </thead>
      <tbody>
        {rows.map(([label, across, height, id]) => (
          <tr key={id}>
            <th scope="row">{label}</th>
            <td data-testid={`cross-track-${id}`}>{metres(across, 2)}</td>
            <td data-testid={`height-error-${id}`}>{metres(height, 2)}</td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}

function lagWord(lag_s: number | null): string {
  if (lag_s === null) return DASH;
  return `${withUnit(Math.abs(lag_s), "s", 1)} ${lag_s >= 0 ? "late" : "early"}`;
}

/** What the flight came to, against its plan. */
export function Figures({ review }: { review: ReviewDoc }) {
  const { figures } = review;
  if (!figures) {
    return (
      <section class="facts" data-testid="figures">
        <h2>Figures</h2>
        <p class="muted">
          There is no plan to judge this flight against. Open its plan, then tick “The plan that is open” on
          the left.
        </p>
      </section>
    );
  }
  const words = { more: "high", less: "low" };
  const higher = higherWords(figures);
  return (
    <section class="facts" data-testid="figures">
      <h2>Distance to the surface model</h2>
      <Distance figures={figures} />
      <dl class="figures-list">
        <Figure label="Smallest height above" value={clearance(figures.min_vertical_m)} />
        <Figure
          label="On the way home"
          value={clearance(figures.min_distance_way_home_m)}
          level={
            figures.min_distance_way_home_m !== null && figures.min_distance_way_home_m <= 0
              ? "bad"
              : "neutral"
          }
        />
      </dl>
      <h2>Off the planned line</h2>
      <Deviations figures={figures} />
      <dl class="figures-list">
        <Figure label="Highest above it" value={deviation(figures.height_error_highest_m, words)} />
        <Figure label="Lowest against it" value={deviation(figures.height_error_lowest_m, words)} />
      </dl>
      <h2>Flight</h2>
      <dl class="figures-list">
        <Figure
          label="Mission"
          value={figures.completed ? "completed" : "not completed"}
          level={figures.completed ? "good" : "near"}
          testid="completed"
        />
        {higher && <Figure label="Flown higher" value={higher} testid="flown-higher" />}
        <Figure label="Duration" value={duration(figures.duration_s)} testid="flown-duration" />
        <Figure label="Predicted" value={duration(figures.predicted_s)} testid="predicted-duration" />
        <Figure label="Lag behind the timing" value={lagWord(figures.lag_s)} testid="lag" />
      </dl>
    </section>
  );
}
