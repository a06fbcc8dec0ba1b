import type { PlanDoc, PlanState } from "../messages";
import { ApiError, asErrorDoc, requestJson } from "../net/api";
import { EditQueue, type Edit } from "./edits";
import { isObserver } from "./flying";
import { isDone } from "./outcomes";
import { editedPlace, notifyText, setError, setPlan } from "./state";

/** The page's one edit queue, and the requests that it leads to. */
export const queue = new EditQueue();

const RETRY_MS = 1000;
const EDIT_LIMIT_MS = 15_000;
/** No answer, or one that says "not now". */
const RETRIED = new Set([0, 502, 503, 504]);
let timer: ReturnType<typeof setTimeout> | undefined;
let idleWaiters: (() => void)[] = [];

export function showPlan(): void {
  setPlan(queue.server, queue.document, queue.dirty);
  if (!queue.dirty) {
    idleWaiters.forEach((resolve) => resolve());
    idleWaiters = [];
  }
}

/** Changes the plan: at once on this page, soon on the server. */
export function edit(
  label: string,
  place: string,
  change: Edit["change"],
  options: { coalesce?: boolean } = {},
): void {
  if (isObserver.value) return;
  queue.edit({ label: label.slice(0, 60), place, change, coalesce: options.coalesce ?? false });
  setError(place, null);
  editedPlace.value = place;
  showPlan();
  pump();
}

/** Changes one group of the plan's fields, such as `surface`. */
export function editGroup<K extends "survey" | "profile" | "surface" | "path" | "mission" | "clearance">(
  group: K,
  place: string,
  label: string,
  fields: Partial<PlanDoc[K]>,
  coalesce = false,
): void {
  const change = (document: PlanDoc): PlanDoc => ({
    ...document,
    [group]: { ...document[group], ...fields },
  });
  edit(label, place, change, { coalesce });
}

/** Resolves when the server has every edit. */
export function allSent(): Promise<void> {
  return queue.dirty ? new Promise((resolve) => idleWaiters.push(resolve)) : Promise.resolve();
}

function pump(): void {
  clearTimeout(timer);
  const step = queue.next(performance.now());
  if (!step) return;
  if ("wait_ms" in step) timer = setTimeout(pump, step.wait_ms);
  else void send(step.send, step.place);
}

async function send(body: object, place: string): Promise<void> {
  try {
    queue.accepted(await requestJson<PlanState>("PUT", "/api/plan", body, { limit_ms: EDIT_LIMIT_MS }));
  } catch (error) {
    if (error instanceof ApiError && error.doc.code === "stale") await mergeStale(place);
    else if (error instanceof ApiError && RETRIED.has(error.status)) return retry();
    else {
      queue.refused();
      setError(place, asErrorDoc(error));
    }
  }
  showPlan();
  pump();
}

function retry(): void {
  queue.unanswered();
  showPlan();
  timer = setTimeout(pump, RETRY_MS);
}

async function mergeStale(place: string): Promise<void> {
  try {
    const { plan } = await requestJson<{ plan: PlanState }>("GET", "/api/state");
    const again = queue.stale(plan);
    const what = "The plan had changed meanwhile, on another page or in the 3D view.";
    if (again) notifyText("info", what, "Your edit was made again on the newer plan.");
    else notifyText("warning", what, "Your last edit was not kept: make it again.");
  } catch (error) {
    queue.unanswered();
    setError(place, asErrorDoc(error));
  }
}

/** A request that answers with the plan's new state: undo, open, shortest order ... */
export async function command(path: string, place: string, body?: object): Promise<boolean> {
  if (isObserver.value) return false;
  await allSent();
  return isDone(place, async () => {
    queue.takeAnswer(await requestJson<PlanState>("POST", path, body));
    showPlan();
  });
}
