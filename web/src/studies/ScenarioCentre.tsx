import { duration, metres } from "../format";
import type { ScenarioFigureDoc, ScenarioPartDoc } from "../messages";
import { chosenScenario, shownResult } from "../store/studies";
import { Icon } from "../ui/Icon";
import { limitText, measuredText, textWithUnit } from "./scenarios";
import { ScenarioChart } from "./ScenarioChart";

function FigureRow({ figure }: { figure: ScenarioFigureDoc }) {
  const { verdict } = figure;
  const kind = verdict === null ? "neutral" : verdict === "reached" ? "good" : "bad";
  return (
    <tr class={kind} data-testid="scenario-figure" data-verdict={verdict ?? "none"}>
      <th scope="row">{figure.words}</th>
      <td class="value" data-label="Measured">
        {textWithUnit(measuredText(figure.value), figure.unit)}
      </td>
      <td data-label="Paper">{figure.paper}</td>
      <td class="limit" data-label="Held to">
        {limitText(figure)}
      </td>
      <td class="verdict-cell">
        {verdict && <Icon name={kind === "good" ? "check" : "cross"} size={16} />} {verdict?.toLowerCase()}
      </td>
    </tr>
  );
}

function Figures({ figures }: { figures: readonly ScenarioFigureDoc[] }) {
  if (figures.length === 0) return null;
  return (
    <div class="figure-table">
      <table class="study-table" data-testid="scenario-figures">
        <thead>
          <tr>
            <th scope="col" />
            <th scope="col">Measured</th>
            <th scope="col">Paper</th>
            <th scope="col">Held to</th>
            <th scope="col" />
          </tr>
        </thead>
        <tbody>
          {figures.map((figure) => (
            <FigureRow key={figure.words} figure={figure} />
          ))}
        </tbody>
      </table>
    </div>
  );
}

function Part({ part }: { part: ScenarioPartDoc }) {
  return (
    <section class="scenario-part" data-testid="scenario-part">
      <h3>{part.title}</h3>
      {part.duration_s > 0 && (
        <p class="muted">
          {duration(part.duration_s)} flown, {part.contact ? "CONTACT" : "no contact"}, nearest{" "}
          {metres(part.min_true_distance_m, 2)}, {part.alerts} alerts
        </p>
      )}
      <Figures figures={part.figures} />
      {part.charts.length > 0 && (
        <div class="scenario-charts">
          {part.charts.map((chart) => (
            <ScenarioChart key={chart.title} chart={chart} />
          ))}
        </div>
      )}
      {part.notes.length > 0 && (
        <details>
          <summary>Notes ({part.notes.length})</summary>
          <ul class="scenario-notes">
            {part.notes.map((note, index) => (
              <li key={index}>{note}</li>
            ))}
          </ul>
        </details>
      )}
    </section>
  );
}

/** What a scenario came to, figure by figure beside the paper's, with its curves. */
export function ScenarioCentre() {
  const [result, chosen] = [shownResult.value, chosenScenario.value];
  if (!result) {
    return (
      <div class="study-empty muted">
        <p>The papers' field tests, flown in simulation through the code that flies live.</p>
        {chosen && (
          <p>
            {chosen.flown} {chosen.held} ({chosen.paper})
          </p>
        )}
        <p>Run one on the left, or open what an earlier one came to.</p>
      </div>
    );
  }
  const { run, parts } = result;
  return (
    <div class="scenario-result" data-testid="scenario-result" tabIndex={0}>
      <header class="study-head">
        <h2>
          {run.name}, seed {run.seed}
        </h2>
        <strong class={`run-mark ${run.passed ? "good" : "bad"}`} data-testid="scenario-verdict">
          <Icon name={run.passed ? "check" : "cross"} size={18} />{" "}
          {run.passed ? "Every figure was reached" : "Not every figure was reached"}
        </strong>
      </header>
      {parts.map((part) => (
        <Part key={part.title} part={part} />
      ))}
    </div>
  );
}
