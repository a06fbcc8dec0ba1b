import { describe, expect, it } from "vitest";
import * as f from "../src/format";
import { checkNumber } from "../src/ui/NumberField";

describe("numbers", () => {
  it.each([
    [0, 0, "0"],
    [-0.004, 2, "0.00"],
    [-1.5, 1, "\u22121.5"],
    [1234, 0, "1234"],
    [1234567.8, 1, "1\u202f234\u202f567.8"],
  ])("%d with %d decimals is %s", (value, decimals, text) => {
    expect(f.number(value, decimals)).toBe(text);
  });

  it.each([null, undefined, NaN, Infinity])("%s is shown as a dash, never as a number", (value) => {
    for (const format of [f.number, f.metres, f.length, f.duration, f.percent]) {
      expect(format(value)).toBe(f.DASH);
    }
  });

  it("carry their unit", () => {
    expect(f.metres(3.456, 2)).toBe("3.46\u00a0m");
    expect(f.length(12_345)).toBe("12.35\u00a0km");
    expect(f.percent(0.034, 1)).toBe("3.4\u00a0%");
  });
});

describe("counts", () => {
  it.each([
    [300_000, "300\u202f000"],
    [1_000_000, "1.0\u00a0M"],
    [12_540_000, "12.5\u00a0M"],
    [100_400_000, "100\u00a0M"],
  ])("%d is %s", (value, text) => {
    expect(f.many(value)).toBe(text);
  });
});

describe("places", () => {
  it("have 7 decimals and can be pasted", () => {
    expect(f.latLon({ lat_deg: -36.8421337, lon_deg: 175.5 })).toBe("-36.8421337, 175.5000000");
  });
});

describe("times", () => {
  it.each([
    [7, "0:07"],
    [59.6, "1:00"],
    [750, "12:30"],
    [3900, "1:05:00"],
  ])("%d s is %s", (seconds, text) => {
    expect(f.duration(seconds)).toBe(text);
  });

  it("ages are coarse", () => {
    expect([200, 8_000, 200_000].map(f.age)).toEqual(["now", "8 s", "3 min"]);
  });

  it("a broken timestamp is a dash", () => {
    expect(f.clock("yesterday")).toBe(f.DASH);
    expect(f.clock(1_700_000_000)).toBe(f.clock("2023-11-14T22:13:20Z"));
    expect(f.clock(NaN)).toBe(f.DASH);
  });
});

describe("typed numbers", () => {
  it.each([
    ["2,5", 2.5],
    [" 1 000 ", 1000],
    ["\u22123", -3],
    [".5", 0.5],
    ["1e2", 100],
    ["", null],
    ["12m", null],
    ["NaN", null],
    ["1e999", null],
  ])("%j is %j", (text, value) => {
    expect(f.parseNumber(text)).toBe(value);
  });

  it("out of range or not whole are told with the bounds", () => {
    const range = { min: 1, max: 10, step: 1, whole: true };
    expect(checkNumber("5", range, "m")).toBe(5);
    expect(checkNumber("11", range, "m")).toContain("1 to 10 m");
    expect(checkNumber("2.5", range, "m")).toContain("whole");
    expect(checkNumber("x", range, "m")).toContain('"x" is not a number');
  });
});

describe("messages of the planner", () => {
  it.each([
    ["Declare it, for example --crs EPSG:32633.", "Declare it, for example EPSG:32633."],
    [
      "Reproject it, or declare the right reference system with --crs, for example EPSG:32633.",
      "Reproject it, or declare the right reference system, for example EPSG:32633.",
    ],
    [
      "They look like centimetres: use --z-scale 0.01 if so.",
      "They look like centimetres: declare their unit if so.",
    ],
    ["If they are metres, use --z-scale 1.", "If they are metres, declare their unit."],
    ["Negate them (gdal_calc.py --calc=-A), or leave them.", "Negate them, or leave them."],
    [
      "Give the configuration that the radar ran with: --cfg FILE.",
      "Give the configuration that the radar ran with, on the left.",
    ],
    [
      "Give the time between the two files' beginnings: --offset-s.",
      "Give the time between the two files' beginnings, on the left.",
    ],
    [
      "take the whole frames alone: --frames 12.",
      "take the whole frames alone (“Only the first frames”: 12).",
    ],
    ["Choose a place on known ground.", "Choose a place on known ground."],
  ])("%s", (message, shown) => expect(f.forConsole(message)).toBe(shown));
});

describe("clearances", () => {
  it("are rounded down, never up", () => {
    expect(f.demanded(4.6101)).toBe("4.62\u00a0m");
    expect(f.demanded(4.61)).toBe("4.61\u00a0m");
    expect(f.clearance(6.2599)).toBe("6.25\u00a0m");
    expect(f.clearance(6.26)).toBe("6.26\u00a0m");
    expect(f.clearance(-0.004)).toBe("\u22120.01\u00a0m");
    expect(f.clearance(null)).toBe(f.DASH);
  });
});

describe("flight", () => {
  it("deviations have a direction in words", () => {
    const words = { more: "right", less: "left" };
    expect(f.deviation(0.42, words)).toBe("0.42\u00a0m right");
    expect(f.deviation(-1.2, words)).toBe("1.20\u00a0m left");
    expect(f.deviation(0.001, words)).toBe("0.00\u00a0m");
    expect(f.deviation(null, words)).toBe(f.DASH);
  });

  it("bearings have three digits and a compass point", () => {
    expect([0, 7.4, 359.7, -90, 74].map(f.bearing)).toEqual(["000°", "007°", "000°", "270°", "074°"]);
    expect([0, 44, 359, 225].map(f.compassPoint)).toEqual(["N", "NE", "N", "SW"]);
  });

  it("sizes have fitting units", () => {
    expect([0, 999, 1234, 12_345_678, 5e9].map(f.bytes)).toEqual([
      "0\u00a0B",
      "999\u00a0B",
      "1.2\u00a0kB",
      "12\u00a0MB",
      "5.0\u00a0GB",
    ]);
    expect(f.bytes(null)).toBe(f.DASH);
  });

  it("time codes have tenths", () => {
    expect([0, 7.44, 59.99, 187.4].map(f.timecode)).toEqual(["0:00.0", "0:07.4", "0:59.9", "3:07.4"]);
    expect(f.timecode(-3)).toBe("0:00.0");
  });

  it("settings are shown as they were set, and whole numbers whole", () => {
    expect([Math.fround(0.07), Math.fround(0.8), -1, 9000, 16_777_217, 1 / 3].map(f.asSet)).toEqual([
      "0.07",
      "0.8",
      "-1",
      "9000",
      "16777217",
      String(1 / 3),
    ]);
  });
});
