import { duration, metres } from "../format";
import type { ScenarioFigureDoc, ScenarioPartDoc } from "../messages";
import { Icon } from "../ui/Icon";
import { limitText, measuredText, textWithUnit } from "./scenarios";
import { ScenarioChart } from "./ScenarioChart";

function FigureRow({ figure, isHeld }: { figure: ScenarioFigureDoc; isHeld: boolean }) {
  const { verdict } = figure;
  const kind = verdict === null ? "neutral" : verdict === "reached" ? "good" : "bad";
  return (
    <tr class={kind} data-testid="scenario-figure" data-verdict={verdict ?? "none"}>
      <th scope="row">{figure.words}</th>
      <td class="value" data-label="Measured">
        {textWithUnit(measuredText(figure.value), figure.unit)}
      </td>
      <td data-label="Paper">{figure.paper}</td>
      {isHeld && (
        <td class="limit" data-label="Held to">
          {limitText(figure)}
        </td>
      )}
      {isHeld && (
        <td class="verdict-cell">
          {verdict && <Icon name={kind === "good" ? "check" : "cross"} size={16} />} {verdict?.toLowerCase()}
        </td>
      )}
    </tr>
  );
}

function Figures({ figures }: { figures: readonly ScenarioFigureDoc[] }) {
  if (figures.length === 0) return null;
  // Of what is only measured beside the paper nothing is held to anything.
  const isHeld = figures.some((one) => one.verdict !== null);
  return (
    <div class="figure-table">
      <table class="study-table" data-testid="scenario-figures">
        <thead>
          <tr>
            <th scope="col" />
            <th scope="col">Measured</th>
            <th scope="col">Paper</th>
            {isHeld && <th scope="col">Held to</th>}
            {isHeld && <th scope="col" />}
          </tr>
        </thead>
        <tbody>
          {figures.map((figure) => (
            <FigureRow key={figure.words} figure={figure} isHeld={isHeld} />
          ))}
        </tbody>
      </table>
    </div>
  );
}

/** One flight, or what else was measured: figures beside the paper's, curves, notes. */
export function ScenarioPart({ part }: { part: ScenarioPartDoc }) {
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
