import { computed, effect, signal, untracked } from "@preact/signals";
import type { ComparedDoc, ParameterDoc, ParametersDoc, WrittenAnswer, WrittenDoc } from "../messages";
import { ApiError, asErrorDoc, requestJson } from "../net/api";
import { sendFile } from "./files";
import { active, stillOf } from "./fleet";
import { adopted } from "./flying";
import { order, pending } from "./outcomes";
import { setError } from "./state";

export const PARAMETERS = "parameters";
/** The list of a slow radio takes a minute, and what got lost is asked for again. */
const READ_LIMIT_MS = 600_000;

/** As this page last heard of them; null: not read. */
export const parameters = signal<ParametersDoc | null>(null);
export const compared = signal<ComparedDoc | null>(null);
/** Number of the vehicle whose list is read to be compared. */
export const comparingWith = signal<number | null>(null);
export const written = signal<readonly WrittenDoc[]>([]);
/** Numbers of the vehicles whose list this page waits for. */
const reading = signal<ReadonlySet<number>>(new Set());
export const isReading = computed(() => reading.value.has(active.value));

const vehicleId = computed(() => adopted.value?.id ?? null);

/** Nothing of one vehicle is shown as another's. */
effect(() => {
  void vehicleId.value;
  void active.value;
  untracked(() => {
    parameters.value = compared.value = null;
    written.value = [];
  });
});

async function take(ask: () => Promise<ParametersDoc>): Promise<void> {
  const isStill = stillOf();
  try {
    const now = await ask();
    if (!isStill()) return;
    parameters.value = now;
    setError(PARAMETERS, null);
  } catch (error) {
    if (!isStill()) return;
    // Not read yet: the page says how.
    if (error instanceof ApiError && error.doc.code === "not_ready") parameters.value = null;
    else setError(PARAMETERS, asErrorDoc(error));
  }
}

/** What was read before, by any page. */
export const lookAtParameters = () => take(() => requestJson<ParametersDoc>("GET", "/api/parameters"));

export async function readParameters(): Promise<void> {
  const asked = active.peek();
  reading.value = new Set([...reading.value, asked]);
  compared.value = null;
  await take(() =>
    requestJson<ParametersDoc>("POST", "/api/parameters/read", {}, { limit_ms: READ_LIMIT_MS }),
  );
  reading.value = new Set([...reading.value].filter((number) => number !== asked));
}

export async function writeParameter(name: string, value: number): Promise<void> {
  if (pending.value.has(PARAMETERS)) return;
  const isStill = stillOf();
  const body = { changes: [{ name, value }] };
  const answer = await order({ place: PARAMETERS, path: "/api/parameters/write", body });
  if (!answer) return;
  const came = (await answer.json()) as WrittenAnswer;
  if (!isStill()) return;
  parameters.value = came.now;
  if (compared.value) compared.value = stillDifferent(compared.value, came.written);
  written.value = [...came.written, ...written.value.filter((one) => one.name !== name)];
}

async function sendTo<T>(path: string, file: File): Promise<T | null> {
  setError(PARAMETERS, null);
  try {
    return JSON.parse(await sendFile(`${path}?${new URLSearchParams({ filename: file.name })}`, file)) as T;
  } catch (error) {
    setError(PARAMETERS, asErrorDoc(error));
    return null;
  }
}

export async function compareWith(file: File): Promise<void> {
  const isStill = stillOf();
  const doc = await sendTo<ComparedDoc>("/api/parameters/compare", file);
  if (isStill()) compared.value = doc;
}

/** Its list is read anew: what it held before may not be so any more. */
export async function compareWithVehicle(other: number): Promise<void> {
  const isStill = stillOf();
  comparingWith.value = other;
  setError(PARAMETERS, null);
  try {
    const doc = await requestJson<ComparedDoc>(
      "POST",
      `/api/parameters/compare/${other}`,
      {},
      { limit_ms: READ_LIMIT_MS },
    );
    if (isStill()) compared.value = doc;
  } catch (error) {
    if (isStill()) setError(PARAMETERS, asErrorDoc(error));
  } finally {
    comparingWith.value = null;
  }
}

/** Without the rows that are as asked by now. */
export function stillDifferent(made: ComparedDoc, written: readonly WrittenDoc[]): ComparedDoc {
  const taken = new Map(written.filter((one) => one.took).map((one) => [one.name, one.asked]));
  const left = made.differences.filter(({ name, there }) => there === null || taken.get(name) !== there);
  return { ...made, same: made.same + made.differences.length - left.length, differences: left };
}

export async function describeBy(file: File): Promise<void> {
  const isStill = stillOf();
  const doc = await sendTo<ParametersDoc>("/api/parameters/descriptions", file);
  if (doc && isStill()) parameters.value = doc;
}

/** Those whose name or description has the text; changed: only what differs from its default. */
export function found(all: readonly ParameterDoc[], text: string, changed: boolean): ParameterDoc[] {
  const words = text.trim().toLowerCase();
  return all.filter(
    (one) =>
      (!changed || one.changed) &&
      (words === "" || `${one.name} ${one.title} ${one.help}`.toLowerCase().includes(words)),
  );
}

/** A value that was typed, or words about what is wrong with it. Beyond the makers' range is only worth a note. */
export function checkValue(one: ParameterDoc, text: string): number | string {
  const value = Number(text.trim().replace(",", "."));
  if (text.trim() === "" || !Number.isFinite(value)) return `"${text}" is no number.`;
  if (one.whole && !Number.isInteger(value)) return `${one.name} holds whole numbers only.`;
  return value;
}

export function outside(one: ParameterDoc, value: number): string | null {
  const low = one.low !== null && value < one.low;
  const high = one.high !== null && value > one.high;
  if (!low && !high) return null;
  return `Its makers recommend ${one.low ?? "any"} to ${one.high ?? "any"} ${one.unit}`.trim() + ".";
}
