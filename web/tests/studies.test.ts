import { describe, expect, it } from "vitest";
import type { RadarMap } from "../src/messages";
import { addressOf, studyIn, viewIn } from "../src/store/address";
import { ticks } from "../src/chart/axes";
import { LEVELS, fan, powerAt, spanOfColumns, spanOfRows, upright } from "../src/studies/maps";
import { limitText, measuredText } from "../src/studies/scenarios";
import { Newest } from "../src/studies/newest";

const base64 = (cells: number[]) => btoa(String.fromCharCode(...cells));

function map(fields: Partial<RadarMap>, cells: number[]): RadarMap {
  return {
    rows: 2,
    columns: 2,
    floor_db: 20,
    top_db: 80,
    first_row: 0,
    row_step: 1,
    first_column: 0,
    column_step: 1,
    ...fields,
    cells: base64(cells),
  };
}

const colourAt = (picture: ReturnType<typeof upright>, x: number, y: number) =>
  [...picture.rgba.slice(4 * (y * picture.width + x), 4 * (y * picture.width + x) + 4)] as const;

describe("a radar's map", () => {
  it("stands upright: its first row is the lowest", () => {
    const picture = upright(map({}, [0, 255, 128, 64]));
    expect(colourAt(picture, 1, 1)).toEqual([...(LEVELS[255] ?? []), 255]);
    expect(colourAt(picture, 0, 0)).toEqual([...(LEVELS[128] ?? []), 255]);
  });

  it("tells power where its cells are, and nothing beside them", () => {
    const speeds = map({ first_row: -1, row_step: 0.5, column_step: 2 }, [0, 255, 128, 64]);
    expect(powerAt(speeds, -1, 2)).toBe(80);
    expect(powerAt(speeds, -0.6, 0.4)).toBeCloseTo(50.1, 1);
    expect(powerAt(speeds, -1, 3.1)).toBeNull();
    expect(spanOfRows(speeds)).toEqual([-1.25, -0.25]);
    expect(spanOfColumns(speeds)).toEqual([-1, 3]);
  });

  it("seen from above has its range from the radar and its azimuth to the right", () => {
    // Ranges 0, 10, 20 m; sines -1, -0.5, 0, 0.5: one echo at 20 m, half to the right.
    const cells = new Array<number>(12).fill(0);
    cells[2 * 4 + 3] = 255;
    const echo = map({ rows: 3, columns: 4, row_step: 10, first_column: -1, column_step: 0.5 }, cells);
    const picture = fan(echo, 50, 25, 1);
    const at = (right_m: number, forward_m: number) =>
      colourAt(picture, 25 + right_m, 24 - forward_m).slice(0, 3);
    expect(at(10, 17)).toEqual([...(LEVELS[255] ?? [])]);
    expect(at(-10, 17)).toEqual([...(LEVELS[0] ?? [])]);
    expect(at(5, 8)).toEqual([...(LEVELS[0] ?? [])]);
    // Beyond the last range nothing is drawn.
    expect(colourAt(picture, 49, 0)[3]).toBe(0);
  });
});

describe("axes", () => {
  it("have round numbers within their ends", () => {
    expect(ticks(-10.4, 10.4, 4).map(({ text }) => text)).toEqual(["\u221210", "0", "10"]);
    expect(ticks(0, 1, 5).map(({ at }) => at)).toEqual([0, 0.2, 0.4, 0.6000000000000001, 0.8, 1]);
    expect(ticks(1, 1, 5)).toEqual([]);
  });
});

describe("of questions asked in quick succession", () => {
  const ended = () => new Promise((resolve) => setTimeout(resolve));

  it("the first and the newest are asked", async () => {
    const asked: number[] = [];
    const newest = new Newest(500, () => 0);
    for (const number of [1, 2, 3]) newest.ask(async () => void asked.push(number));
    await ended();
    expect(asked).toEqual([1, 3]);
  });

  it("one that takes long is given up for a newer one, a quick one is not", async () => {
    let now_ms = 0;
    const newest = new Newest(500, () => now_ms);
    const given: boolean[] = [];
    const slow = (signal: AbortSignal) =>
      new Promise<void>((resolve) => {
        signal.addEventListener("abort", () => resolve(void given.push(true)));
      });
    newest.ask(slow);
    now_ms = 400;
    newest.ask(async () => undefined);
    expect(given).toEqual([]);
    now_ms = 600;
    let last = false;
    newest.ask(async () => void (last = true));
    await ended();
    expect([given, last]).toEqual([[true], true]);
  });
});

describe("a scenario's figures", () => {
  const figure = { words: "", value: null, unit: "m", verdict: null, paper: "", least: null, most: null };

  it.each([
    [0.03456, "0.0346"],
    [12.345, "12.3"],
    [1234.5, "1235"],
    [1, "1"],
    [0.8, "0.800"],
    [0.00001, "0.0000"],
    [null, "–"],
  ])("%d is %s", (value, text) => expect(measuredText(value)).toBe(text));

  it("say what they are held to", () => {
    expect(limitText({ ...figure, least: 0.9 })).toBe("≥ 0.900 m");
    expect(limitText({ ...figure, most: 3 })).toBe("≤ 3 m");
    expect(limitText({ ...figure, least: 1, most: 1, unit: "" })).toBe("1");
    expect(limitText(figure)).toBe("");
  });
});

describe("the address", () => {
  it.each([
    ["#review/radar", "radar"],
    ["#review/scenarios", "scenarios"],
    ["#review", null],
    ["#review/nothing", null],
  ])("%s tells what Review looks at", (hash, study) => {
    expect(studyIn(hash)).toBe(study);
  });

  it("tells the view, and is made of what it tells", () => {
    expect(["#plan", "#review/radar", "", "#elsewhere"].map(viewIn)).toEqual(["plan", "review", null, null]);
    expect(addressOf("fly", "radar")).toBe("#fly");
    expect(addressOf("review", "flights")).toBe("#review");
    expect(addressOf("review", "radar")).toBe("#review/radar");
  });
});
