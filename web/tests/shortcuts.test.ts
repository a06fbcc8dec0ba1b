import { describe, expect, it } from "vitest";
import { afterG, pressedAt_ms, shortcutOf } from "../src/shell/shortcuts";

const press = (key: string, mod = false, shift = false) => ({ key, mod, shift });

describe("keys", () => {
  it.each([
    [press("z", true), "undo"],
    [press("Z", true, true), "redo"],
    [press("y", true), "redo"],
    [press("s", true), "save"],
    [press("o", true), "open"],
    [press("a"), "add"],
    [press("Escape"), "select"],
    [press("Delete"), "delete"],
    [press("f"), "fit"],
    [press("t"), "top"],
    [press("v"), "chase"],
    [press("k"), "acknowledge"],
    [press("M"), "sound"],
    [press("?", false, true), "help"],
    [press("h"), "pages"],
  ])("%j means %s", (key, id) => {
    expect(shortcutOf(key, false)?.id).toBe(id);
  });

  it("arrows move the frame where radar files are looked at, the replay where flights are", () => {
    const at = (study: "flights" | "radar", shift = false) =>
      shortcutOf(press("ArrowRight", false, shift), false, { view: "review", study, afterG: false });
    expect(at("radar")).toEqual({ id: "frame", by: 1 });
    expect(at("radar", true)).toEqual({ id: "frame", by: 10 });
    expect(at("flights")?.id).toBe("seek");
    expect(shortcutOf(press(" "), false, { view: "review", study: "radar", afterG: false })).toBeNull();
  });

  it("1 to 8 are the sections", () => {
    expect(shortcutOf(press("4"), false)).toEqual({ id: "section", section: 4 });
    expect(shortcutOf(press("9"), false)).toBeNull();
  });

  it("inside inputs belong to the input, but for saving and opening", () => {
    const inside = ["z", "y", "s", "o"].map((key) => shortcutOf(press(key, true), true)?.id);
    expect(inside).toEqual([undefined, undefined, "save", "open"]);
    expect(["a", "Delete", "1", "?"].map((key) => shortcutOf(press(key), true))).toEqual([
      null,
      null,
      null,
      null,
    ]);
  });

  it("that mean nothing here are left to the browser", () => {
    expect(shortcutOf(press("c", true), false)).toBeNull();
    expect(shortcutOf(press("x"), false)).toBeNull();
  });
});

describe("keys of the views", () => {
  const at = (view: "plan" | "fly" | "review", afterG = false) => ({ view, afterG });

  it("G and a letter go to a view, from anywhere but an input", () => {
    expect(shortcutOf(press("f"), false, at("plan", true))).toEqual({ id: "view", view: "fly" });
    expect(shortcutOf(press("R"), false, at("fly", true))).toEqual({ id: "view", view: "review" });
    expect(shortcutOf(press("f"), false, at("plan"))?.id).toBe("fit");
    expect(shortcutOf(press("p"), true, at("plan", true))).toBeNull();
  });

  it("that change the plan have no meaning elsewhere", () => {
    for (const view of ["fly", "review"] as const) {
      expect(
        [press("a"), press("Delete"), press("z", true)].map((key) => shortcutOf(key, false, at(view))),
      ).toEqual([null, null, null]);
    }
  });

  it("answer an alert in every view, but never while something is typed", () => {
    for (const view of ["plan", "fly", "review"] as const) {
      expect(shortcutOf(press("k"), false, at(view))?.id).toBe("acknowledge");
      expect(shortcutOf(press("m"), false, at(view))?.id).toBe("sound");
    }
    expect(shortcutOf(press("k"), true, at("fly"))).toBeNull();
  });

  it("steer the replay in Review only", () => {
    expect(shortcutOf(press(" "), false, at("review"))?.id).toBe("play");
    expect(shortcutOf(press("ArrowLeft"), false, at("review"))).toEqual({ id: "seek", by_s: -10 });
    expect(shortcutOf(press("ArrowRight"), false, at("review"))).toEqual({ id: "seek", by_s: 10 });
    expect(shortcutOf(press(" "), false, at("fly"))).toBeNull();
    expect(shortcutOf(press(" "), true, at("review"))).toBeNull();
  });
});

describe("G and the key after it", () => {
  const onPage = (opened_ms: number, timeStamp: number) =>
    ({ timeStamp, view: { performance: { timeOrigin: opened_ms } } }) as unknown as UIEvent;

  it("count on one clock, whichever of the two pages has the focus", () => {
    const g = pressedAt_ms(onPage(9000, 1000));
    expect(afterG(g, pressedAt_ms(onPage(2000, 8400)))).toBe(true);
    expect(afterG(g, pressedAt_ms(onPage(2000, 9600)))).toBe(false);
    // Long ago on our page, by the younger clock of the 3D view's page.
    expect(afterG(pressedAt_ms(onPage(2000, 5000)), pressedAt_ms(onPage(9000, 1000)))).toBe(false);
  });

  it("are none without G", () => {
    expect(afterG(-Infinity, 5)).toBe(false);
  });
});
