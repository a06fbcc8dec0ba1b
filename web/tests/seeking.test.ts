import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import type { ReplayStatus, ReviewDoc } from "../src/messages";
import { giveUpOrders } from "../src/store/outcomes";
import { PLAYING, playhead_s, replay, review, seek, seekBy, seeking } from "../src/store/review";
import { errors } from "../src/store/state";

let answers: ((response: Response) => void)[] = [];
let asked_s: number[] = [];

beforeEach(() => {
  vi.useFakeTimers({ toFake: ["setTimeout", "clearTimeout"] });
  [answers, asked_s] = [[], []];
  vi.stubGlobal("fetch", (_path: string, { body, signal }: RequestInit) => {
    return new Promise<Response>((resolve, reject) => {
      answers.push(resolve);
      asked_s.push((JSON.parse(body as string) as { at_s: number }).at_s);
      signal?.addEventListener("abort", () => reject(new DOMException("", "AbortError")));
    });
  });
  review.value = { recording: { id: "a" }, duration_s: 100 } as ReviewDoc;
  [replay.value, seeking.value, errors.value] = [null, null, {}];
});

afterEach(() => {
  vi.useRealTimers();
  vi.unstubAllGlobals();
});

const status = (at_s: number): ReplayStatus => ({
  t_mono_s: 0,
  recording: "a",
  start_utc_s: 1000,
  end_utc_s: 1100,
  at_utc_s: 1000 + at_s,
  playing: false,
  speed: 1,
  error: null,
});
const done = () => new Response(null, { status: 204 });
const refused = () => {
  const answered = new Response(null, { status: 409 });
  answered.text = () => Promise.resolve(JSON.stringify({ error: { what: "It is still being opened." } }));
  return answered;
};

/** A turn of the event loop by its own clock: all that the answer's promises lead to has come to pass. */
const later = globalThis.setTimeout;
const taken = () => new Promise<void>((then) => later(then, 0));

function answer(number: number, response: Response): Promise<void> {
  answers[number]?.(response);
  return taken();
}

describe("a jump", () => {
  it("is shown for as long as its answer takes, and three seconds more", async () => {
    seek(60);
    await vi.advanceTimersByTimeAsync(60_000);
    expect(playhead_s.value).toBe(60);
    await answer(0, done());
    await vi.advanceTimersByTimeAsync(2900);
    expect(playhead_s.value).toBe(60);
    await vi.advanceTimersByTimeAsync(200);
    expect(playhead_s.value).toBe(0);
  });

  it("that is refused is shown no more, and the next one counts from where the replay is", async () => {
    seek(60);
    await answer(0, refused());
    expect([playhead_s.value, errors.value[PLAYING]?.what]).toEqual([0, "It is still being opened."]);
    replay.value = { status: status(5), received_ms: 0 };
    seekBy(10);
    expect(playhead_s.value).toBe(15);
    await answer(1, done());
    expect(asked_s).toEqual([60, 15]);
  });

  it("stays where a later one went when the one before is refused", async () => {
    seek(60);
    seek(70);
    seek(80);
    await answer(0, refused());
    expect([playhead_s.value, asked_s]).toEqual([80, [60, 80]]);
    await answer(1, refused());
    expect(playhead_s.value).toBe(0);
  });

  it("is not cut short by the time of the one before", async () => {
    seek(60);
    await answer(0, done());
    await vi.advanceTimersByTimeAsync(2000);
    seek(70);
    await vi.advanceTimersByTimeAsync(2000);
    expect(playhead_s.value).toBe(70);
    await answer(1, done());
  });

  it("that a silent server never answers is given up with its order", async () => {
    seek(60);
    giveUpOrders();
    await taken();
    expect(playhead_s.value).toBe(0);
  });
});

describe("a drag", () => {
  it("stays with the pointer though a place on its way is refused", async () => {
    seek(60, false);
    await answer(0, refused());
    expect(playhead_s.value).toBe(60);
    seek(61);
    await answer(1, refused());
    expect(playhead_s.value).toBe(0);
  });
});
