import { signal } from "@preact/signals";
import type { ErrorDoc } from "../messages";
import { asErrorDoc, request } from "../net/api";
import { serverNow_s } from "./server_clock";
import { setError } from "./state";

/** What a command came to, by the place on the page where it was given. */
export const outcomes = signal<Readonly<Record<string, string>>>({});
/** Commands that have not been answered yet. */
export const pending = signal<ReadonlySet<string>>(new Set());

const SHOWN_MS = 8000;
const timers = new Map<string, ReturnType<typeof setTimeout>>();

export function say(place: string, text: string | null): void {
  clearTimeout(timers.get(place));
  const { [place]: _, ...others } = outcomes.value;
  outcomes.value = text === null ? others : { ...others, [place]: text };
  if (text !== null)
    timers.set(
      place,
      setTimeout(() => say(place, null), SHOWN_MS),
    );
}

/** What was done may no longer be so, and nobody can look. */
export function forgetSaid(): void {
  for (const place of Object.keys(outcomes.value)) say(place, null);
}

function setPending(place: string, isPending: boolean): void {
  const next = new Set(pending.value);
  if (isPending) next.add(place);
  else next.delete(place);
  pending.value = next;
}

/** So long somebody who needs the vehicle to act now waits for an answer before they are told that there is none. */
const PATIENCE_MS = 3000;
/** An order about the vehicle that comes to the server later than that is not done any more: by then somebody may have
 * taken the transmitter. What is asked of plans, maps and recordings is as good late. */
const GOOD_FOR_S = 5;
const ABOUT_THE_VEHICLE = /^\/api\/(flight|lease|link|parameters\/write|obstacles\/(avoidance|manoeuvre))\b/;

const unknown = (what: string, moves: boolean): ErrorDoc => ({
  code: "no_answer",
  what: `${what}: it is not known whether this arrived.`,
  where: "",
  advice: moves
    ? "Take the pilot's transmitter if the vehicle must act now."
    : "See what became of it when the server answers again.",
});

let waiting = new AbortController();

/** The server answers nothing any more: nobody is left to wait for an answer that may never come. */
export function giveUpOrders(): void {
  waiting.abort();
  waiting = new AbortController();
}

/** The last order of each place: a late answer to one before it is nobody's any more. */
const last = new Map<string, object>();

/** Another vehicle is shown: what comes of them is none of its business. */
export function forgetOrders(): void {
  for (const place of last.keys()) setError(place, null);
  last.clear();
  pending.value = new Set();
  forgetSaid();
}

interface Order {
  /** Where its outcome appears. */
  place: string;
  path: string;
  body?: object;
  method?: "POST" | "PUT" | "DELETE";
  /** What to say once it is done. */
  done?: string;
  /** The vehicle acts on it: somebody waits, with the pilot's transmitter at hand. */
  moves?: boolean;
}

/** Gives one command to the server; returns its answer, or null when it failed, which the place then says. */
export async function order(given: Order): Promise<Response | null> {
  const { place, path, body, method = "POST", done, moves = false } = given;
  const { signal } = waiting;
  const isLast = () => last.get(place) === given;
  const settle = (error: ErrorDoc | null) => {
    if (!isLast()) return;
    setPending(place, false);
    setError(place, error);
  };
  last.set(place, given);
  setPending(place, true);
  say(place, null);
  // It goes on being waited for: a late answer takes the place of these words.
  const patience = moves ? setTimeout(() => settle(unknown("No answer yet", moves)), PATIENCE_MS) : undefined;
  try {
    const answer = await request(method, path, body, { signal, headers: goodUntil(path) });
    settle(null);
    if (done && isLast()) say(place, done);
    return answer;
  } catch (error) {
    settle(signal.aborted ? unknown("The server does not answer", moves) : asErrorDoc(error));
    return null;
  } finally {
    clearTimeout(patience);
  }
}

function goodUntil(path: string): Record<string, string> {
  const now_s = serverNow_s(performance.now());
  return now_s === null || !ABOUT_THE_VEHICLE.test(path)
    ? {}
    : { "Hedgehop-Good-Until": (now_s + GOOD_FOR_S).toFixed(3) };
}

/** Whether what is asked of the server is done; its error appears at `place`. */
export async function isDone(place: string, asked: () => Promise<unknown>): Promise<boolean> {
  try {
    await asked();
    setError(place, null);
    return true;
  } catch (error) {
    setError(place, asErrorDoc(error));
    return false;
  }
}

/** A request without an answer to keep; its error appears at `place`. */
export const act = (method: string, path: string, place: string) =>
  isDone(place, () => request(method, path));
