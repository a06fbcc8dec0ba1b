import { describe, expect, it, vi } from "vitest";
import type { ComparedDoc, ParameterDoc, ParametersDoc, WrittenDoc } from "../src/messages";
import { linkStatus } from "./flight_samples";

vi.stubGlobal("location", { protocol: "http:", host: "test", hash: "" });
const { checkValue, found, outside, parameters, stillDifferent } = await import("../src/store/parameters");
const { linkStatus: link } = await import("../src/store/flying");

const one = (fields: Partial<ParameterDoc>) =>
  ({
    name: "RTL_ALT",
    title: "",
    help: "",
    unit: "",
    low: null,
    high: null,
    whole: false,
    ...fields,
  }) as ParameterDoc;

describe("parameters", () => {
  it("are found by name and description, and by what differs from the default", () => {
    const all = [
      one({ title: "Return altitude", changed: true }),
      one({ name: "FENCE_ENABLE", help: "Return" }),
    ];
    expect(found(all, "return", false)).toHaveLength(2);
    expect(found(all, "rtl_", false).map(({ name }) => name)).toEqual(["RTL_ALT"]);
    expect(found(all, "", true).map(({ name }) => name)).toEqual(["RTL_ALT"]);
  });

  it("take numbers, whole ones where the vehicle holds whole ones", () => {
    expect(checkValue(one({}), " 12,5 ")).toBe(12.5);
    expect(checkValue(one({}), "")).toBe('"" is no number.');
    expect(checkValue(one({}), "1e999")).toBe('"1e999" is no number.');
    expect(checkValue(one({ whole: true }), "1.5")).toBe("RTL_ALT holds whole numbers only.");
  });

  it("beyond the makers' range are worth a note", () => {
    const ranged = one({ low: 30, high: 3000, unit: "cm" });
    expect(outside(ranged, 30)).toBeNull();
    expect(outside(ranged, 29)).toBe("Its makers recommend 30 to 3000 cm.");
  });

  it("that were written as there are no difference any more", () => {
    const differences = [
      { name: "RTL_ALT", here: 1500, there: 1800 },
      { name: "WPNAV_SPEED", here: 500, there: 900 },
      { name: "ONLY_HERE", here: 1, there: null },
    ];
    const made = { file: "Wasp", same: 3, differences, notes: [] } as unknown as ComparedDoc;
    const took = (name: string, asked: number, took: boolean) => ({ name, asked, took }) as WrittenDoc;
    const now = stillDifferent(made, [took("RTL_ALT", 1800, true), took("WPNAV_SPEED", 900, false)]);
    expect(now.differences.map(({ name }) => name)).toEqual(["WPNAV_SPEED", "ONLY_HERE"]);
    expect(now.same).toBe(4);
  });

  it("of one vehicle are not shown as another's", () => {
    link.value = { status: linkStatus(), received_ms: 0 };
    parameters.value = { vehicle: "vehicle 1" } as ParametersDoc;
    link.value = { status: linkStatus(), received_ms: 1 };
    expect(parameters.value).not.toBeNull();
    const other = { id: "b", address: "udpin:0.0.0.0:14551" };
    link.value = { status: linkStatus({ adopted: other } as never), received_ms: 2 };
    expect(parameters.value).toBeNull();
  });
});
