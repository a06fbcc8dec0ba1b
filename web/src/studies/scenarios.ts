import { effect, signal } from "@preact/signals";
import { DASH, number } from "../format";
import type { ScenarioDoc, ScenarioFigureDoc, ScenarioResultDoc, ScenarioRunDoc } from "../messages";
import { asErrorDoc, requestJson } from "../net/api";
import { order } from "../store/outcomes";
import { chosenName, runs, scenarios, shownResult } from "../store/studies";
import { setError } from "../store/state";

/** Scenarios: what this page asks of the server, and what their figures say. */

/** Where errors of this study appear. */
export const SCENARIOS = "scenarios";
export const RUNS = "scenario_runs";

const path = (id: string) => `/api/scenarios/runs/${encodeURIComponent(id)}`;

/** The run that this page has started: its result is opened once it is there. */
const awaited = signal<string | null>(null);

/** What there is and what was run, asked with every new connection; the stream tells what changes. */
export async function learn(): Promise<void> {
  try {
    scenarios.value = await requestJson<ScenarioDoc[]>("GET", "/api/scenarios");
    runs.value = await requestJson<ScenarioRunDoc[]>("GET", "/api/scenarios/runs");
    chosenName.value ??= scenarios.value[0]?.name ?? null;
  } catch (error) {
    setError(SCENARIOS, asErrorDoc(error));
  }
}

export async function run(name: string, seed: number): Promise<void> {
  const answer = await order({ place: RUNS, path: "/api/scenarios/runs", body: { name, seed } });
  if (answer) awaited.value = ((await answer.json()) as ScenarioRunDoc).id;
}

export const cancel = (id: string) => order({ place: RUNS, path: `${path(id)}/cancel` });

export async function remove(id: string): Promise<void> {
  const gone = await order({ place: RUNS, path: path(id), method: "DELETE" });
  if (gone && shownResult.value?.run.id === id) shownResult.value = null;
}

export async function openResult(id: string): Promise<void> {
  setError(RUNS, null);
  try {
    shownResult.value = await requestJson<ScenarioResultDoc>("GET", path(id));
    chosenName.value = shownResult.value.run.name;
  } catch (error) {
    setError(RUNS, asErrorDoc(error));
  }
}

effect(() => {
  const mine = runs.value.find((one) => one.id === awaited.value);
  if (!mine || mine.state === "running") return;
  awaited.value = null;
  if (mine.state === "done") void openResult(mine.id);
  else if (mine.error) setError(RUNS, mine.error);
});

/** Three digits that count, as the command line has it; small numbers keep theirs. */
export function measuredText(value: number | null): string {
  if (value === null) return DASH;
  const decimals = value === 0 ? 0 : Math.min(4, Math.max(0, 2 - Math.floor(Math.log10(Math.abs(value)))));
  return number(value, Number.isInteger(value) ? 0 : decimals);
}

export const textWithUnit = (text: string, unit: string) =>
  unit && text !== DASH ? `${text} ${unit}` : text;

export function limitText({ least, most, unit }: ScenarioFigureDoc): string {
  if (least !== null && most !== null && least === most) return textWithUnit(measuredText(least), unit);
  if (least !== null) return `≥ ${textWithUnit(measuredText(least), unit)}`;
  return most === null ? "" : `≤ ${textWithUnit(measuredText(most), unit)}`;
}
