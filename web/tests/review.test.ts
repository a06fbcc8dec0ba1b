import { describe, expect, it } from "vitest";
import type { ReplayStatus, ReviewDoc, ReviewEvent, ReviewFigures, ReviewSeries } from "../src/messages";
import { playhead, replay, review, seeking, takeReviewing } from "../src/store/review";
import { flownLevel, higherWords } from "../src/review/judged";
import { alertTimes, axisTime, columns, eventAt, momentAt, reachOf } from "../src/review/time";
import { roundStep } from "../src/chart/axes";

const status = (fields: Partial<ReplayStatus> = {}): ReplayStatus => ({
  t_mono_s: 0,
  recording: "a",
  start_utc_s: 1000,
  end_utc_s: 1100,
  at_utc_s: 1020,
  playing: true,
  speed: 2,
  error: null,
  ...fields,
});
const known = (fields: Partial<ReplayStatus> = {}) => ({ status: status(fields), received_ms: 5000 });

describe("the replay's clock", () => {
  it("runs on at its speed between two messages", () => {
    expect(playhead(known(), 5000)).toBeCloseTo(20);
    expect(playhead(known(), 6500)).toBeCloseTo(23);
  });

  it("stands still while paused, and at both ends", () => {
    expect(playhead(known({ playing: false }), 60_000)).toBeCloseTo(20);
    expect(playhead(known(), 1e9)).toBe(100);
    expect(playhead(known({ at_utc_s: 900, playing: false }), 5000)).toBe(0);
  });

  it("is nowhere when nothing is open", () => {
    expect(playhead(null, 0)).toBeNull();
    expect(playhead(known({ recording: null }), 5000)).toBeNull();
  });
});

describe("a review", () => {
  const doc = (id: string) => ({ recording: { id } }) as ReviewDoc;

  it("of another recording ends a drag on the old one's time line", () => {
    takeReviewing({ v: 1, type: "review", review: doc("a") }, 0);
    seeking.value = { at_s: 12, isOver: false };
    takeReviewing({ v: 1, type: "review", review: doc("a") }, 0);
    expect(seeking.value?.at_s).toBe(12);
    takeReviewing({ v: 1, type: "review", review: doc("b") }, 0);
    expect(seeking.value).toBeNull();
    takeReviewing({ v: 1, type: "review", review: null }, 0);
    expect(review.value).toBeNull();
  });

  it("stays where it was jumped to until the replay has got there", () => {
    const told = (at_utc_s: number) =>
      takeReviewing({ v: 1, type: "replay", now_mono_s: 1, replay: status({ at_utc_s, speed: 1 }) }, 0);
    seeking.value = { at_s: 70, isOver: false };
    told(1070);
    expect(seeking.value).not.toBeNull();
    seeking.value = { at_s: 70, isOver: true };
    told(1020);
    expect(seeking.value).not.toBeNull();
    told(1070.2);
    expect(seeking.value).toBeNull();
  });

  it("takes where the replay is, with the time it was told", () => {
    takeReviewing({ v: 1, type: "replay", now_mono_s: 1, replay: status() }, 77);
    expect(replay.value?.received_ms).toBe(77);
  });
});

describe("events", () => {
  const events = [1, 5, 5, 9].map((t_s) => ({ t_s }) as ReviewEvent);

  it("are found by time: the last that has happened", () => {
    expect([0, 1, 4.9, 5, 8, 100].map((at_s) => eventAt(events, at_s))).toEqual([-1, 0, 0, 2, 2, 3]);
    expect(eventAt(events, null)).toBe(-1);
    expect(eventAt([], 5)).toBe(-1);
  });
});

describe("the alerts of a recording", () => {
  it("are marked where they begin, not where they end", () => {
    const event = (t_s: number, kind: string, severity: number) => ({ t_s, kind, severity, text: "" });
    const events = [event(1, "text", 2), event(2, "alert", 4), event(5, "alert", 6), event(9, "alert", 4)];
    expect(alertTimes(events)).toEqual([2, 9]);
  });
});

describe("the charts", () => {
  it("say what holds at a time, and nothing where it is unknown", () => {
    const series = {
      t_s: [0, 10, 20],
      alt_rel_home_m: [0, 10, 20],
      reference_alt_rel_home_m: [1, 11, 21],
      planned_alt_rel_home_m: [1, 12, 20],
      ground_rel_home_m: [0, null, 0],
      cross_track_m: [0.5, -0.5, 0],
      s_m: [0, 1, 2],
      distance_to_dsm_m: [3, 4, 5],
    } as ReviewSeries;
    expect(momentAt(series, 5)).toEqual({
      flown_m: 5,
      reference_m: 6,
      ground_m: null,
      cross_track_m: 0,
      distance_m: 3.5,
    });
    expect(momentAt(series, 99).flown_m).toBeNull();
  });

  it("count time in minutes and seconds", () => {
    expect([0, 59.6, 60, 605].map(axisTime)).toEqual(["0:00", "1:00", "1:00", "10:05"]);
  });
});

describe("the histogram", () => {
  const histogram = { edges_m: [0, 0.1, 0.2], counts: [4, 1] };

  it("has its highest column full, and its largest value within", () => {
    const reach_m = reachOf(histogram, 0.25);
    expect(reach_m).toBeGreaterThan(0.25);
    const [first, second] = columns(histogram, reach_m);
    expect([first?.height, second?.height]).toEqual([1, 0.25]);
    expect(second?.from).toBeCloseTo(0.1 / reach_m);
  });

  it("survives a flight without a single error", () => {
    expect(reachOf({ edges_m: [], counts: [] }, null)).toBeGreaterThan(0);
    expect(columns({ edges_m: [0, 0], counts: [0] }, 1)[0]?.height).toBe(0);
  });

  it("is counted in round steps", () => {
    expect([0.75, 1.9, 4, 0.03].map((reach) => roundStep(reach))).toEqual([0.2, 0.5, 1, 0.01]);
  });
});

describe("the distance flown", () => {
  it("is a warning below what was certified, and bad at contact", () => {
    expect(flownLevel(5, 4)).toBe("good");
    expect(flownLevel(3, 4)).toBe("near");
    expect(flownLevel(0, 4)).toBe("bad");
    expect(flownLevel(3, 4, 3.5)).toBe("bad");
    expect(flownLevel(3.6, 4, 3.5)).toBe("near");
    expect(flownLevel(3, null)).toBe("neutral");
    expect(flownLevel(null, 4)).toBe("neutral");
  });
});

describe("a flight that avoidance took higher", () => {
  const figures = (fields: Partial<ReviewFigures>) =>
    ({ higher_m: null, higher_from_item: null, ...fields }) as ReviewFigures;

  it("says by how much and from where", () => {
    expect(higherWords(figures({ higher_m: 9.4, higher_from_item: 3 }))).toBe("by 9\u00a0m from item 3");
    expect(higherWords(figures({}))).toBeNull();
  });
});
