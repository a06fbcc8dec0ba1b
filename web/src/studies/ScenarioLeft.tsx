import { Changes } from "../ui/Changes";
import { useEffect, useState } from "preact/hooks";
import { day, duration, percent } from "../format";
import { LIMITS, type ScenarioRunDoc } from "../messages";
import { pending } from "../store/outcomes";
import { chosenName, chosenScenario, running, runs, scenarios, shownResult } from "../store/studies";
import { pageId } from "../store/state";
import { Bar } from "../ui/Bar";
import { Button } from "../ui/Button";
import { Icon } from "../ui/Icon";
import { NumberField } from "../ui/NumberField";
import { Section } from "../ui/Section";
import { RUNS, SCENARIOS, cancel, learn, openResult, remove, run } from "./scenarios";

function Choice() {
  useEffect(() => void learn(), [pageId.value]);
  return (
    <Section id={SCENARIOS} title="Scenarios" icon="flag" summary={chosenName.value ?? "…"} startsOpen>
      <ul class="pick-list scenarios" aria-label="Scenarios">
        {(scenarios.value ?? []).map((one) => (
          <li key={one.name} class={one.name === chosenName.value ? "current" : ""}>
            <button
              type="button"
              class="pick"
              aria-pressed={one.name === chosenName.value}
              data-testid={`scenario-${one.name}`}
              onClick={() => (chosenName.value = one.name)}
            >
              <span class="radio" aria-hidden="true" />
              <span class="scenario-text">
                <strong>{one.name}</strong>
                <span>{one.flown}</span>
                <span class="muted">{one.held}</span>
                <span class="muted">{one.paper}</span>
              </span>
            </button>
          </li>
        ))}
      </ul>
    </Section>
  );
}

/** What its end was, in a mark and a word. */
function RunMark({ of }: { of: ScenarioRunDoc }) {
  if (of.state === "done" && of.passed) return <Mark kind="good" icon="check" text="reached" />;
  if (of.state === "done") return <Mark kind="bad" icon="cross" text="not reached" />;
  if (of.state === "failed") return <Mark kind="bad" icon="warning" text="failed" />;
  return <Mark kind="neutral" icon="cross" text="cancelled" />;
}

function Mark({ kind, icon, text }: { kind: string; icon: "check" | "cross" | "warning"; text: string }) {
  return (
    <span class={`run-mark ${kind}`}>
      <Icon name={icon} size={16} /> {text}
    </span>
  );
}

function Row({ of }: { of: ScenarioRunDoc }) {
  const isOpen = shownResult.value?.run.id === of.id;
  const took = of.seconds === null ? "" : `, took ${duration(of.seconds)}`;
  return (
    <li class={`recording ${isOpen ? "current" : ""}`} data-testid="run-row" data-state={of.state}>
      <button
        type="button"
        class="pick"
        aria-pressed={isOpen}
        disabled={of.state !== "done"}
        data-testid="run-open"
        onClick={() => void openResult(of.id)}
      >
        <span class="radio" aria-hidden="true" />
        <span class="recording-text">
          <strong>
            {of.name}, seed {of.seed}
          </strong>
          <RunMark of={of} />
          <span class="muted">
            {day(of.started_utc)}
            {took}
          </span>
        </span>
      </button>
      {of.state === "done" && (
        <Button
          kind="quiet"
          class="small"
          icon="trash"
          title={`Delete the result of ${of.name}, seed ${of.seed}`}
          testid="run-delete"
          onClick={() => void remove(of.id)}
        />
      )}
    </li>
  );
}

function Results() {
  const over = runs.value.filter((one) => one.state !== "running");
  return (
    <Section
      id={RUNS}
      title="Results"
      icon="folder"
      summary={over.length ? `${over.length}` : "none yet"}
      startsOpen
    >
      {over.length === 0 && <p class="hint">What scenarios come to is kept here, the last 50 of them.</p>}
      <ul class="pick-list recordings" aria-label="Results">
        {over.map((one) => (
          <Row key={one.id} of={one} />
        ))}
      </ul>
    </Section>
  );
}

function Running({ of }: { of: ScenarioRunDoc }) {
  return (
    <div class="scenario-running" role="status" data-testid="scenario-running">
      <p>
        {of.name}, seed {of.seed}: {of.step} {of.progress !== null && <strong>{percent(of.progress)}</strong>}
      </p>
      {of.progress === null ? (
        <span class="spinner" aria-hidden="true" />
      ) : (
        <Bar share={of.progress} label="Scenario" />
      )}
      <Button kind="quiet" icon="cross" testid="scenario-cancel" onClick={() => void cancel(of.id)}>
        Cancel
      </Button>
    </div>
  );
}

function Start() {
  const [seed, setSeed] = useState(0);
  const [now, chosen] = [running.value, chosenScenario.value];
  return (
    <footer class="primary-action">
      <Changes>
        {now && <Running of={now} />}
        {chosen?.command_line_only && (
          <p class="muted action-hint">Too long for a browser: run it on the command line</p>
        )}
        <NumberField
          label="Seed of scene, noise and wind"
          unit=""
          value={seed}
          {...LIMITS.RunScenario.seed}
          step={1}
          whole
          testid="scenario-seed"
          onChange={setSeed}
        />
        <Button
          kind="primary"
          class="wide"
          icon="play"
          disabled={!chosen || chosen.command_line_only || now !== null || pending.value.has(RUNS)}
          testid="scenario-run"
          onClick={() => chosen && void run(chosen.name, seed)}
        >
          Run {chosen?.name ?? ""}
        </Button>
      </Changes>
    </footer>
  );
}

/** Which scenario, what was run, and Run as the one primary action. */
export function ScenarioLeft() {
  return (
    <>
      <div class="panel-scroll">
        <Choice />
        <Results />
      </div>
      <Start />
    </>
  );
}
