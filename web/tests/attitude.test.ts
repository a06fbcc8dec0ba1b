import { describe, expect, it } from "vitest";
import { HALF_HEIGHT, PER_DEG, horizon, ladder, tape } from "../src/vehicle/attitude";

const RAD = Math.PI / 180;

describe("the horizon", () => {
  it("goes up when the nose goes down, and down when it goes up", () => {
    expect(horizon(0, -10 * RAD).down).toBeCloseTo(-10 * PER_DEG);
    expect(horizon(0, 10 * RAD).down).toBeCloseTo(10 * PER_DEG);
  });

  it("turns to the left in a bank to the right", () => {
    expect(horizon(20 * RAD, 0).turn_deg).toBeCloseTo(-20);
    expect(horizon(-20 * RAD, 0).turn_deg).toBeCloseTo(20);
  });

  it("never leaves the window: which way is up stays visible", () => {
    expect(Math.abs(horizon(0, -80 * RAD).down)).toBeLessThan(HALF_HEIGHT);
    expect(Math.abs(horizon(0, 80 * RAD).down)).toBeLessThan(HALF_HEIGHT);
  });
});

describe("the ladder", () => {
  it("has nose-up rungs above the horizon, long and labelled each ten degrees", () => {
    const rungs = ladder();
    const at = (pitch_deg: number) => rungs.find((rung) => rung.pitch_deg === pitch_deg);
    expect(at(10)?.y).toBeCloseTo(-10 * PER_DEG);
    expect(at(-20)?.y).toBeCloseTo(20 * PER_DEG);
    expect([at(10)?.label, at(-20)?.label, at(5)?.label]).toEqual(["10", "20", ""]);
    expect(at(0)).toBeUndefined();
    expect(at(10)?.halfWidth).toBeGreaterThan(at(5)?.halfWidth ?? Infinity);
  });
});

describe("the heading tape", () => {
  it("has the heading in its middle, and east to the right of north", () => {
    const marks = tape(0);
    expect(marks.find((mark) => mark.label === "N")?.x).toBeCloseTo(0);
    expect(marks.find((mark) => mark.label === "030")?.x).toBeGreaterThan(0);
    expect(marks.find((mark) => mark.label === "330")?.x).toBeLessThan(0);
  });

  it("goes around the compass", () => {
    expect(
      tape(350)
        .map((mark) => mark.label)
        .filter(Boolean),
    ).toEqual(["W", "300", "330", "N", "030", "060"]);
    expect(tape(90).find((mark) => mark.label === "E")?.x).toBeCloseTo(0);
  });
});
