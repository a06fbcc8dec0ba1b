import { signal } from "@preact/signals";
import type { ChecklistDoc, ChecklistPoint, ChecklistText } from "../messages";
import { asErrorDoc, requestJson } from "../net/api";
import { fly } from "./flying";
import { order } from "./outcomes";
import { setError } from "./state";

/** The crew's own list before a start: its text for a vehicle profile, and the ticks of the vehicle that is shown. */

export const CHECKLIST = "checklist";
export const WRITING = "checklist-text";

/** Of which profile the dialog shows the list. */
export const profileShown = signal("");
/** As it is kept; null: not read yet. */
export const checklistText = signal<ChecklistText | null>(null);
/** What was written and not saved yet, by profile: a dialog that is closed by mistake loses nothing. */
export const drafts = signal<Readonly<Record<string, string>>>({});

export function draftOf(profile: string): string | null {
  return drafts.value[profile] ?? null;
}

export function keepDraft(profile: string, text: string | null): void {
  const { [profile]: _, ...others } = drafts.value;
  drafts.value = text === null ? others : { ...others, [profile]: text };
  setError(WRITING, null);
}

export function showChecklist(profile: string): void {
  profileShown.value = profile;
  checklistText.value = null;
  setError(WRITING, null);
}

export async function readChecklist(): Promise<void> {
  const profile = profileShown.value;
  try {
    const text = await requestJson<ChecklistText>(
      "GET",
      `/api/checklist?profile=${encodeURIComponent(profile)}`,
    );
    if (profileShown.value === profile) checklistText.value = text;
  } catch (error) {
    setError(WRITING, asErrorDoc(error));
  }
}

/** Whether it was kept. */
export async function writeChecklist(text: string): Promise<boolean> {
  const known = checklistText.value;
  if (known === null) return false;
  const body = { profile: known.profile, text, instead_of: known.revision };
  const answer = await order({ place: WRITING, path: "/api/checklist", method: "PUT", body, done: "Saved." });
  if (answer === null) return false;
  checklistText.value = (await answer.json()) as ChecklistText;
  keepDraft(known.profile, null);
  return true;
}

/** Whether this point is the first under its heading. */
export function startsHeading(points: readonly ChecklistPoint[], index: number): boolean {
  const heading = points[index]?.heading ?? "";
  return heading !== "" && heading !== points[index - 1]?.heading;
}

/** How many points are still open. */
export const openPoints = (doc: ChecklistDoc | null | undefined) =>
  doc?.points.filter((point) => !point.ticked_by).length ?? 0;

/** Why a start is refused by reason of the list; null: it is not. */
export function checklistObstacle(doc: ChecklistDoc | null | undefined): string | null {
  if (doc?.fault) return "The checklist cannot be read: see above";
  const left = openPoints(doc);
  if (left === 0) return null;
  return left === 1
    ? "Tick the open point of the checklist first"
    : `Tick the checklist first: ${left} points`;
}

/** So long what was put stands after the server has taken it, while the list that shows it is on its way. */
const ON_ITS_WAY_MS = 2000;

/** Ticks on their way to the server and back, by what they are for. */
const underWay = signal<Readonly<Record<string, boolean>>>({});

const keyOf = (digest: string, revision: string, number: number) => `${digest} ${revision} ${number}`;

/** As the operator has just put it, until the server has refused it or its list shows it; then as it is. */
export function isTicked(doc: ChecklistDoc, number: number): boolean {
  const key = keyOf(fly.value?.onboard.digest ?? "", doc.revision, number);
  return underWay.value[key] ?? Boolean(doc.points[number - 1]?.ticked_by);
}

export async function tickPoint(doc: ChecklistDoc, number: number, ticked: boolean): Promise<void> {
  const digest = fly.value?.onboard.digest;
  if (!digest) return;
  const key = keyOf(digest, doc.revision, number);
  underWay.value = { ...underWay.value, [key]: ticked };
  const body = { digest, revision: doc.revision, number, ticked };
  const answer = await order({ place: CHECKLIST, path: "/api/flight/checklist", method: "PUT", body });
  if (answer !== null) await shown(number, ticked);
  const { [key]: _, ...others } = underWay.value;
  underWay.value = others;
}

/** Waits until the server's list shows the point so, or no longer can: the answer may overtake the list. */
function shown(number: number, ticked: boolean): Promise<void> {
  return new Promise((resolve) => {
    const isShown = () => Boolean(fly.value?.checklist?.points[number - 1]?.ticked_by) === ticked;
    const settle = () => {
      clearTimeout(timer);
      stop();
      resolve();
    };
    const timer = setTimeout(settle, ON_ITS_WAY_MS);
    const stop = fly.subscribe(() => {
      if (isShown()) queueMicrotask(settle);
    });
  });
}
