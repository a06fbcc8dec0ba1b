import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { giveUpOrders, order, outcomes, pending } from "../src/store/outcomes";
import { forgetClock, takeClock } from "../src/store/server_clock";
import { errors } from "../src/store/state";

interface Asked {
  headers: Record<string, string>;
  answer: (response: Response) => void;
}

let asked: Asked[] = [];

beforeEach(() => {
  vi.useFakeTimers({ toFake: ["setTimeout", "clearTimeout"] });
  asked = [];
  vi.stubGlobal("fetch", (_path: string, { headers, signal }: RequestInit) => {
    return new Promise<Response>((resolve, reject) => {
      asked.push({ headers: headers as Record<string, string>, answer: resolve });
      signal?.addEventListener("abort", () => reject(new DOMException("", "AbortError")));
    });
  });
  forgetClock();
  outcomes.value = errors.value = {};
});

afterEach(() => {
  vi.useRealTimers();
  vi.unstubAllGlobals();
});

const hold = () => order({ place: "safety", path: "/api/flight/pause", done: "It holds.", moves: true });
const upload = () => order({ place: "next", path: "/api/flight/upload" });
const told = (place: string) => errors.value[place]?.what ?? outcomes.value[place] ?? "";

describe("an order that the vehicle acts on", () => {
  it("is said to be unknown after three seconds, and may be given again", () => {
    void hold();
    vi.advanceTimersByTime(2900);
    expect([pending.value.has("safety"), told("safety")]).toEqual([true, ""]);
    vi.advanceTimersByTime(200);
    expect(pending.value.has("safety")).toBe(false);
    expect(told("safety")).toContain("not known whether this arrived");
    expect(errors.value["safety"]?.advice).toContain("transmitter");
  });

  it("is told when its answer comes late", async () => {
    const given = hold();
    vi.advanceTimersByTime(4000);
    asked[0]?.answer(new Response(null, { status: 204 }));
    await given;
    expect(told("safety")).toBe("It holds.");
  });

  it("says nothing more once another was given after it", async () => {
    const first = hold();
    vi.advanceTimersByTime(3100);
    const second = hold();
    asked[0]?.answer(new Response(null, { status: 204 }));
    await first;
    expect([pending.value.has("safety"), outcomes.value["safety"]]).toEqual([true, undefined]);
    asked[1]?.answer(new Response(null, { status: 204 }));
    await second;
    expect(told("safety")).toBe("It holds.");
  });
});

describe("every order", () => {
  it("is given up at once when nothing is heard of the server any more", async () => {
    const both = [hold(), upload()];
    vi.advanceTimersByTime(1000);
    giveUpOrders();
    await Promise.all(both);
    for (const place of ["safety", "next"]) {
      expect(told(place)).toContain("not known whether this arrived");
      expect(pending.value.has(place)).toBe(false);
    }
  });

  it("may take long where no vehicle waits for it", () => {
    void upload();
    vi.advanceTimersByTime(60_000);
    expect([pending.value.has("next"), told("next")]).toEqual([true, ""]);
    giveUpOrders();
  });

  it("says until when it is good, by the server's clock, in doubt for longer", () => {
    void upload();
    expect(asked[0]?.headers["Hedgehop-Good-Until"]).toBeUndefined();
    const now_ms = performance.now();
    takeClock({ v: 1, type: "clock", page_ms: now_ms - 1000, now_mono_s: 700 }, now_ms);
    void upload();
    expect(Number(asked[1]?.headers["Hedgehop-Good-Until"])).toBeCloseTo(700 + 0.5 + 5 + 0.5, 1);
    giveUpOrders();
  });

  it("is good for as long as it takes where it reaches no vehicle", () => {
    const now_ms = performance.now();
    takeClock({ v: 1, type: "clock", page_ms: now_ms, now_mono_s: 700 }, now_ms);
    for (const path of ["/api/obstacles/seen", "/api/scenarios/runs", "/api/flights"])
      void order({ place: "seen", path });
    expect(asked.map(({ headers }) => headers["Hedgehop-Good-Until"])).toEqual([
      undefined,
      undefined,
      undefined,
    ]);
    for (const path of ["/api/obstacles/avoidance", "/api/lease/take", "/api/link/adopt"])
      void order({ place: "seen", path });
    expect(asked.slice(3).every(({ headers }) => "Hedgehop-Good-Until" in headers)).toBe(true);
    giveUpOrders();
  });
});
