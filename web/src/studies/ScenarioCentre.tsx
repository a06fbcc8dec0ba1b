import { chosenScenario, shownResult } from "../store/studies";
import { Icon } from "../ui/Icon";
import { ScenarioPart } from "./ScenarioPart";

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
        <ScenarioPart key={part.title} part={part} />
      ))}
    </div>
  );
}
