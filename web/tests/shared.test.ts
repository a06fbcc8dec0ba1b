import { beforeEach, describe, expect, it } from "vitest";
import type { ViewDoc } from "../src/messages";
import { forgetAsked, nextChange, takeAnswer, takeSelection, takeView } from "../src/store/shared";
import { NOTHING_SELECTED, selection, view } from "../src/store/state";

const shown = (fields: Partial<ViewDoc>): ViewDoc => ({ ...view.value, ...fields });

describe("what all pages show together", () => {
  beforeEach(() => {
    forgetAsked();
    takeView(shown({ show_path: true, show_regions: true, show_explained: true }));
  });

  it("is as another page sets it", () => {
    takeView(shown({ show_path: false }));
    expect(view.value.show_path).toBe(false);
  });

  it("keeps this page's change while the server still tells of states before it", () => {
    const before = shown({});
    view.value = shown({ show_explained: false });
    const change = nextChange();
    takeView(before);
    expect(view.value.show_explained).toBe(false);
    takeView(shown({ show_explained: false }));
    takeAnswer(change);
    expect(view.value.show_explained).toBe(false);
  });

  it("waits for the newest of several changes", () => {
    const first = nextChange();
    const second = nextChange();
    takeView(shown({ show_regions: false }));
    takeAnswer(first);
    expect(view.value.show_regions).toBe(true);
    takeAnswer(second);
    expect(view.value.show_regions).toBe(false);
  });

  it("loses nothing that others changed meanwhile", () => {
    const change = nextChange();
    takeSelection({ ...NOTHING_SELECTED, tool: "polygon" });
    takeView(shown({ show_path: false }));
    takeAnswer(change);
    expect([view.value.show_path, selection.value.tool]).toEqual([false, "polygon"]);
  });

  it("waits for no answer that a lost connection took along", () => {
    nextChange();
    takeView(shown({ show_path: false }));
    forgetAsked();
    expect(view.value.show_path).toBe(true);
    takeView(shown({ show_regions: false }));
    expect([view.value.show_path, view.value.show_regions]).toEqual([true, false]);
  });
});
