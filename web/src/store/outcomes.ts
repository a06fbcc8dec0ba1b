import { signal } from "@preact/signals";
import { asErrorDoc, request } from "../net/api";
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

function setPending(place: string, isPending: boolean): void {
  const next = new Set(pending.value);
  if (isPending) next.add(place);
  else next.delete(place);
  pending.value = next;
}

interface Order {
  /** Where its outcome appears. */
  place: string;
  path: string;
  body?: object;
  method?: "POST" | "PUT" | "DELETE";
  /** What to say once it is done. */
  done?: string;
}

/** Gives one command to the server; returns its answer, or null when it failed, which the place then says. */
export async function order({ place, path, body, method = "POST", done }: Order): Promise<Response | null> {
  setPending(place, true);
  say(place, null);
  try {
    const answer = await request(method, path, body);
    setError(place, null);
    if (done) say(place, done);
    return answer;
  } catch (error) {
    setError(place, asErrorDoc(error));
    return null;
  } finally {
    setPending(place, false);
  }
}

/** A request without an answer to keep; its error appears at `place`. */
export async function act(method: string, path: string, place: string): Promise<boolean> {
  try {
    await request(method, path);
    setError(place, null);
    return true;
  } catch (error) {
    setError(place, asErrorDoc(error));
    return false;
  }
}
