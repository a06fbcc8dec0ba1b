import { beforeEach, describe, expect, it, vi } from "vitest";
import { selection } from "../src/store/state";
import { drawer } from "../src/store/view";
import { aim, aimsFor } from "../src/vehicle/aiming";

vi.mock("../src/store/stream", () => ({
  setSelection: (fields: object) => (selection.value = { ...selection.value, ...fields }),
}));

vi.mock("../src/store/view", async () => {
  const { signal } = await import("@preact/signals");
  return { drawer: signal(null) };
});

const PLACE = { lat_deg: 37, lon_deg: 15 };

describe("a place that is clicked for a question", () => {
  beforeEach(() => {
    selection.value = { ...selection.value, tool: "select", place: null };
    drawer.value = null;
  });

  it("is seen whole, and its answer in the drawer in which it was asked for", () => {
    const then = vi.fn();
    drawer.value = "left";
    aim("home", then);
    expect([aimsFor(), drawer.value]).toEqual(["home", null]);
    selection.value = { ...selection.value, tool: "select", place: PLACE };
    expect(then).toHaveBeenCalledWith(PLACE);
    expect([aimsFor(), drawer.value]).toEqual([null, "left"]);
  });

  it("opens no drawer where there was none, nor where nothing was clicked", () => {
    aim("home", vi.fn());
    selection.value = { ...selection.value, tool: "select", place: PLACE };
    expect(drawer.value).toBeNull();
    drawer.value = "left";
    aim("way", vi.fn());
    selection.value = { ...selection.value, tool: "select", place: null };
    expect([aimsFor(), drawer.value]).toEqual([null, null]);
  });
});
