import { describe, expect, it } from "vitest";
import { againstFlown, followsPlan, markerShare, tolerance_m, verdictOf } from "../src/vehicle/deviation";

describe("a plan", () => {
  const state = (armed: boolean, landed: "on_ground" | "in_air" | "landing" | null, mode: string) => ({
    armed,
    landed,
    mode,
  });

  it("is followed in the air in a mode that does so", () => {
    expect(followsPlan(state(true, "in_air", "AUTO"))).toBe(true);
    expect(followsPlan(state(true, null, "GUIDED"))).toBe(true);
  });

  it("is not followed on the ground, on the way home, or by hand", () => {
    expect(followsPlan(state(true, "on_ground", "AUTO"))).toBe(false);
    expect(followsPlan(state(false, "in_air", "AUTO"))).toBe(false);
    expect(followsPlan(state(true, "in_air", "RTL"))).toBe(false);
    expect(followsPlan(state(true, "landing", "AUTO"))).toBe(false);
    expect(followsPlan(null)).toBe(false);
  });
});

describe("a deviation", () => {
  it("may be the position error and half a metre", () => {
    expect(tolerance_m(1.1)).toBe(1.1);
    expect(tolerance_m(0)).toBe(1);
    expect(tolerance_m(null)).toBe(1);
  });

  it("is within, beyond or far off, to either side", () => {
    expect([0, 0.6, -0.6, 0.61, -1.2, 1.21].map((error) => verdictOf(error, 0.6))).toEqual([
      "within",
      "within",
      "within",
      "beyond",
      "beyond",
      "far",
    ]);
    expect(verdictOf(null, 1)).toBe("unknown");
    expect(verdictOf(NaN, 1)).toBe("unknown");
  });

  it("lies right of the middle when positive, and stays at the bar's end when it is large", () => {
    expect(markerShare(0, 0.6)).toBe(0.5);
    expect(markerShare(0.6, 0.6)).toBeCloseTo(0.5 + 1 / 6);
    expect(markerShare(-99, 0.6)).toBe(0);
    expect(markerShare(99, 0.6)).toBe(1);
  });
});

describe("a flight that avoidance has raised", () => {
  it("is held against the plan and what it was raised by", () => {
    const { height_error_m, raised_m, isOnLine } = againstFlown(14.3, {
      state: "offset",
      height_offset_m: 14,
    });
    expect(height_error_m).toBeCloseTo(0.3);
    expect(verdictOf(height_error_m, 0.6)).toBe("within");
    expect([raised_m, isOnLine]).toEqual([14, true]);
  });

  it("is not judged on its way up or past something", () => {
    for (const state of ["holding", "climbing", "manoeuvre", "ceiling"] as const)
      expect(againstFlown(6, { state, height_offset_m: 0 }).isOnLine).toBe(false);
    for (const state of ["off", "watching", "released"] as const)
      expect(againstFlown(6, { state, height_offset_m: 0 })).toMatchObject({
        isOnLine: true,
        height_error_m: 6,
      });
  });

  it("without a position has no error", () => {
    expect(againstFlown(null, { state: "offset", height_offset_m: 3 }).height_error_m).toBeNull();
  });
});
