import { number, percent } from "../format";
import type { SurveyResult } from "../messages";

/** Rounded down: no share is flattered. */
const least = (share: number | null) => percent(Math.floor(Math.max(0, share ?? 0) * 100 + 1e-6) / 100);

function Overlap(props: { label: string; real: number | null; asked: number; testid: string }) {
  return (
    <>
      <dt>{props.label}</dt>
      <dd data-testid={props.testid}>
        {least(props.real)} <span class="muted">of {percent(props.asked)} asked</span>
      </dd>
    </>
  );
}

/** What a survey's photos see over the surface, against what was asked. */
export function Photos({ survey }: { survey: SurveyResult | null }) {
  if (!survey) return null;
  return (
    <section class="facts" data-testid="photos">
      <h2>Photos</h2>
      <dl>
        <dt>Photographed twice</dt>
        <dd data-testid="photographed">
          {least(survey.twice_share)}{" "}
          <span class="muted">
            of {number(survey.area_m2)} m², {number(survey.photos)} photos
          </span>
        </dd>
        <Overlap
          label="Front overlap"
          real={survey.front_overlap}
          asked={survey.asked_front_overlap}
          testid="front-overlap"
        />
        <Overlap
          label="Side overlap"
          real={survey.side_overlap}
          asked={survey.asked_side_overlap}
          testid="side-overlap"
        />
        <dt>Ground sampling</dt>
        <dd data-testid="survey-gsd">
          {number(survey.gsd_cm, 2)} cm <span class="muted">or finer</span>
        </dd>
      </dl>
    </section>
  );
}
