import { day, duration } from "../format";
import { chosenScenario, scenarios, shownResult } from "../store/studies";
import { Fact } from "../ui/Section";

/** What is proved, by whom it was measured first, and what came of it. */
export function ScenarioRight() {
  const result = shownResult.value;
  const about = result ? scenarios.value?.find((one) => one.name === result.run.name) : chosenScenario.value;
  const figures = (result?.parts ?? []).flatMap((part) => part.figures);
  const held = figures.filter((one) => one.verdict !== null);
  return (
    <div class="panel-scroll truth" tabIndex={0}>
      {about && (
        <section class="facts" data-testid="scenario-about">
          <h2>{about.name}</h2>
          <p>{about.flown}</p>
          <h2>Held to</h2>
          <p>{about.held}</p>
          <h2>Paper</h2>
          <p>{about.paper}</p>
        </section>
      )}
      {result && (
        <section class="facts">
          <h2>This run</h2>
          <dl class="figures-list">
            <Fact
              label="Figures reached"
              value={`${held.filter((one) => one.verdict === "reached").length} of ${held.length}`}
            />
            <Fact label="Beside the paper's" value={`${figures.filter((one) => one.paper !== "").length}`} />
            <Fact label="Seed" value={String(result.run.seed)} />
            <Fact label="Started" value={day(result.run.started_utc)} />
            <Fact label="Took" value={duration(result.run.seconds)} />
          </dl>
        </section>
      )}
      <section class="facts">
        <p class="hint">
          The same seed gives the same figures. One scenario runs at a time, in a process that yields to all
          others, and none while a vehicle is armed.
        </p>
      </section>
    </div>
  );
}
