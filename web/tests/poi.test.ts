import { describe, expect, it } from "vitest";
import { moved, parsePlace, poiTitle, withoutPoi, withPoi, withPoiAt } from "../src/store/poi";
import { plan, poi } from "./samples";

const ids = (document: ReturnType<typeof plan>) => document.pois.map(({ id }) => id).join("");

describe("the list of points", () => {
  it("is reordered in both directions", () => {
    expect(moved(["a", "b", "c"], 0, 2)).toEqual(["b", "c", "a"]);
    expect(moved(["a", "b", "c"], 2, 0)).toEqual(["c", "a", "b"]);
  });

  it("stays as it is for places outside of it", () => {
    expect(moved(["a", "b"], 0, 2)).toEqual(["a", "b"]);
    expect(moved(["a", "b"], -1, 0)).toEqual(["a", "b"]);
  });

  it("finds a point by its id, also after others have changed the list", () => {
    expect(ids(withPoiAt("c", 0)(plan()))).toBe("cab");
    expect(ids(withPoiAt("c", 0)(plan({ pois: [poi("x"), poi("c")] })))).toBe("cx");
    expect(ids(withPoiAt("gone", 0)(plan()))).toBe("abc");
  });

  it("changes and drops one point only", () => {
    expect(withPoi("b", { loiter_s: 5 })(plan()).pois.map((entry) => entry.loiter_s)).toEqual([0, 5, 0]);
    expect(ids(withoutPoi("b")(plan()))).toBe("ac");
  });

  it("names points by their number when they have no name", () => {
    expect([poiTitle(poi("a"), 2), poiTitle(poi("a", { name: "Mast" }), 2)]).toEqual(["Point 3", "Mast"]);
  });
});

describe("a typed place", () => {
  it.each(["46.1234567, 7.5", "46.1234567 7.5", " 46.1234567;7.5 "])("%j is read", (text) => {
    expect(parsePlace(text)).toEqual({ lat_deg: 46.1234567, lon_deg: 7.5 });
  });

  it.each(["", "46", "91, 0", "0, 181", "north, east", "1, 2, 3"])("%j is refused", (text) => {
    expect(parsePlace(text)).toBeNull();
  });
});
