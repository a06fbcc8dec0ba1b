import { describe, expect, it, vi } from "vitest";
import type { FenceDoc } from "../src/messages";
import { plan } from "./samples";

vi.stubGlobal("location", { protocol: "http:", host: "test", hash: "" });
const { aroundTo, markTitle, withoutMark } = await import("../src/store/fence");

const place = (lat_deg: number) => ({ lat_deg, lon_deg: 7 });
const fence: FenceDoc = {
  polygons: [
    { id: "p", inclusion: true, corners: [place(1), place(2), place(3), place(4)] },
    { id: "q", inclusion: false, corners: [place(1), place(2), place(3)] },
  ],
  circles: [{ id: "c", inclusion: false, centre: place(5), radius_m: 20 }],
  floor_rel_home_m: null,
  ceiling_rel_home_m: 120,
};
const document = plan({ fence, rally: [{ id: "r", ...place(6), alt_rel_home_m: 30 }] });

describe("the fence of a plan", () => {
  it("loses one corner of a polygon that keeps three", () => {
    const left = withoutMark(document, "p.1").fence.polygons;
    expect(left.map(({ id }) => id)).toEqual(["p", "q"]);
    expect(left[0]?.corners.map(({ lat_deg }) => lat_deg)).toEqual([1, 3, 4]);
  });

  it("loses the whole of a triangle that loses a corner: two corners would enclose nothing", () => {
    expect(withoutMark(document, "q.0").fence.polygons.map(({ id }) => id)).toEqual(["p"]);
  });

  it("loses circles and rally points, and keeps its heights", () => {
    const left = withoutMark(withoutMark(document, "c"), "r");
    expect([left.fence.circles, left.rally, left.fence.ceiling_rel_home_m]).toEqual([[], [], 120]);
  });

  it("calls what is selected by its kind and number", () => {
    const titles = ["p.1", "q", "c", "r", "gone"].map((mark) => markTitle(document, mark));
    expect(titles).toEqual(["corner 2 of polygon 1", "polygon 2", "circle 1", "rally point 1", null]);
  });

  it("names each shape once that the way to a point is laid around", () => {
    const turn = (shape: string, before_poi: number) => ({ lat_deg: 1, lon_deg: 7, shape, before_poi });
    const detours = [
      turn("exclusion circle 1", 2),
      turn("exclusion circle 1", 2),
      turn("inclusion polygon 1", 2),
    ];
    expect(aroundTo(detours, 2)).toEqual(["exclusion circle 1", "inclusion polygon 1"]);
    expect(aroundTo(detours, 1)).toEqual([]);
  });
});
