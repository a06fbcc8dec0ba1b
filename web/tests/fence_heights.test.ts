import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import type { FenceHeightsDoc, OnboardDoc } from "../src/messages";
import {
  changeWords,
  heights,
  heightsOf,
  heightsWritten,
  lookAtHeights,
  setHeights,
} from "../src/store/fence_heights";
import { fly } from "../src/store/flying";
import { forgetOrders } from "../src/store/outcomes";

const ONBOARD = {
  state: "verified",
  digest: "a",
  floor_rel_home_m: null,
  ceiling_rel_home_m: 60,
} as OnboardDoc;
const SHOWN: FenceHeightsDoc = {
  changes: [{ name: "FENCE_ALT_MAX", before: 100, after: 60, unit: "m" }],
  notes: ["The vehicle then returns at 58 m at most: FENCE_MARGIN below the ceiling."],
};
const WRITTEN = {
  name: "FENCE_ALT_MAX",
  asked: 60,
  before: 100,
  after: 60,
  outcome: "set",
  took: true,
  words: "",
};

const asked: { path: string; body: unknown }[] = [];
let answers: Response[] = [];

beforeEach(() => {
  asked.length = 0;
  answers = [];
  vi.stubGlobal("fetch", async (path: string, init: RequestInit) => {
    asked.push({ path, body: JSON.parse(String(init.body ?? "null")) });
    return answers.shift() ?? new Response("{}", { status: 500 });
  });
  fly.value = { onboard: ONBOARD } as never;
  heights.value = null;
});
afterEach(() => (vi.unstubAllGlobals(), forgetOrders()));

describe("floor and ceiling of what is on board", () => {
  it("are named where the plan has them", () => {
    expect(heightsOf(ONBOARD)).toBe("Ceiling 60 m above home");
    expect(heightsOf({ ...ONBOARD, floor_rel_home_m: -2.5 })).toBe("Floor -2.5 m, ceiling 60 m above home");
    expect(heightsOf({ ...ONBOARD, ceiling_rel_home_m: null })).toBeNull();
  });

  it("say old and new, with units where there are some", () => {
    expect(changeWords(SHOWN.changes[0]!)).toBe("100 → 60 m");
    expect(changeWords({ name: "FENCE_TYPE", before: 7, after: 5, unit: "" })).toBe("7 → 5");
  });

  it("are written as they were shown, and shown anew after that", async () => {
    answers = [Response.json(SHOWN), Response.json({ written: [WRITTEN], took: true })];
    await lookAtHeights();
    expect(heights.value).toEqual(SHOWN);
    await setHeights();
    expect(asked.map(({ path }) => path.split("?")[0])).toEqual([
      "/api/flight/fence_heights",
      "/api/flight/fence_heights/set",
    ]);
    expect(asked[1]!.body).toEqual({ changes: SHOWN.changes });
    expect(heights.value).toBeNull();
    expect(heightsWritten.value).toEqual([WRITTEN]);
  });

  it("are not shown of what was on board before", async () => {
    answers = [Response.json(SHOWN)];
    const looking = lookAtHeights();
    fly.value = { onboard: { ...ONBOARD, digest: "b" } } as never;
    await looking;
    expect(heights.value).toBeNull();
    answers = [Response.json(SHOWN)];
    await lookAtHeights();
    expect(heights.value).toEqual(SHOWN);
    fly.value = { onboard: { ...ONBOARD, digest: "c" } } as never;
    expect(heights.value).toBeNull();
  });

  it("are nothing to be written while they were not shown", async () => {
    await setHeights();
    expect(asked).toEqual([]);
  });
});
