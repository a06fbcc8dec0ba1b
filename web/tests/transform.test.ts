import { describe, expect, it } from "vitest";
import type { Chart } from "../src/messages";
import {
  flownSpan,
  gaps,
  heightRange,
  labelsThatFit,
  levelOf,
  levelSpans,
  profileRange,
  valueAt,
} from "../src/chart/transform";
import { tickDecimals } from "../src/chart/axes";

describe("clearance colours", () => {
  it("are red at zero and below, orange below the requirement, green from it on", () => {
    expect([-1, 0, 0.01, 3.34, 3.35].map((d) => levelOf(d, 3.35))).toEqual([
      "bad",
      "bad",
      "near",
      "near",
      "good",
    ]);
  });

  it("are never green where the clearance is unknown", () => {
    expect(levelOf(null, 3)).toBe("unknown");
    expect(levelOf(NaN, 3)).toBe("unknown");
    expect(levelSpans([0, 1, 2], [9, null, 9], 3).map((span) => span.level)).toEqual(["unknown"]);
  });

  it("join equal neighbours, and a step is as bad as its worse end", () => {
    expect(levelSpans([0, 1, 2, 3, 4], [9, 9, 2, 9, 9], 3)).toEqual([
      { from_m: 0, to_m: 1, level: "good" },
      { from_m: 1, to_m: 3, level: "near" },
      { from_m: 3, to_m: 4, level: "good" },
    ]);
  });

  it("cover the whole path without holes", () => {
    const s_m = Array.from({ length: 50 }, (_, index) => index * 2);
    const spans = levelSpans(
      s_m,
      s_m.map((s) => Math.sin(s) * 5),
      3,
    );
    expect(spans[0]?.from_m).toBe(0);
    expect(spans.at(-1)?.to_m).toBe(98);
    spans.slice(1).forEach((span, index) => expect(span.from_m).toBe(spans[index]?.to_m));
  });

  it("of too few samples are none", () => {
    expect(levelSpans([], [], 3)).toEqual([]);
    expect(levelSpans([0], [1], 3)).toEqual([]);
  });
});

describe("unknown ground", () => {
  it("reaches from the last known to the next known sample", () => {
    expect(gaps([0, 1, 2, 3, 4], [5, null, null, 5, 5])).toEqual([[0, 3]]);
  });

  it("may be at both ends or everywhere", () => {
    expect(gaps([0, 1, 2], [null, 5, null])).toEqual([
      [0, 1],
      [1, 2],
    ]);
    expect(gaps([0, 1], [null, null])).toEqual([[0, 1]]);
    expect(gaps([], [])).toEqual([]);
  });
});

describe("the height axis", () => {
  it("holds all curves with a margin", () => {
    const [low, high] = heightRange([
      [0, null, 50],
      [100, -20],
    ]);
    expect(low).toBeLessThan(-20);
    expect(high).toBeGreaterThan(100);
  });

  it("has some height over flat ground, and without any value", () => {
    const [low, high] = heightRange([[3, 3]]);
    expect(high - low).toBeGreaterThanOrEqual(2);
    expect(heightRange([[null]])).toEqual([0, 10]);
  });
});

describe("the value at a place", () => {
  const s_m = [0, 10, 20, 30];
  it("is linear between samples", () => {
    expect(valueAt(s_m, [0, 10, 0, 0], 15)).toBe(5);
    expect(valueAt(s_m, [0, 10, 0, 7], 30)).toBe(7);
  });

  it("is null outside, beside a gap, and without samples", () => {
    expect(valueAt(s_m, [0, 1, 2, 3], -0.1)).toBeNull();
    expect(valueAt(s_m, [0, 1, 2, 3], 30.1)).toBeNull();
    expect(valueAt(s_m, [0, null, 2, 3], 5)).toBeNull();
    expect(valueAt([], [], 0)).toBeNull();
  });
});

describe("labels", () => {
  it("that would overlap are left out", () => {
    expect(labelsThatFit([0, 10, 100], [40, 40, 40])).toEqual([true, false, true]);
  });
});

describe("ticks", () => {
  it("have the decimals that their step needs, and no more", () => {
    expect([50, 5, 2.5, 1, 0.5, 0.25, 0.1, 0.05].map(tickDecimals)).toEqual([0, 0, 1, 0, 1, 2, 1, 2]);
  });
});

describe("the altitude chart's axis", () => {
  const chart = {
    s_m: [0, 100],
    ground_rel_home_m: [0, 10],
    surface_rel_home_m: [5, 15],
    path_rel_home_m: [5, 15],
    flown_rel_home_m: [5, 15],
  } as unknown as Chart;

  it("follows what was flown above and below the plan", () => {
    const [low, high] = profileRange(chart, flownSpan([0, 50, 100], [-12, 31.2, null]));
    expect(low).toBeLessThanOrEqual(-15);
    expect(high).toBeGreaterThanOrEqual(35);
    expect(profileRange(chart, null)).toEqual(profileRange(chart));
  });

  it("changes in steps, and only for what lies along the path", () => {
    expect(flownSpan([0, 50], [3, 31.2])).toEqual([0, 35]);
    expect(flownSpan([0, 50], [3, 33.9])).toEqual([0, 35]);
    expect(flownSpan([0, null], [3, 60])).toEqual([0, 5]);
    expect(flownSpan([], [])).toBeNull();
  });
});
