import { beforeEach, describe, expect, it, vi } from "vitest";
import type { PlanDoc, SelectionDoc } from "../src/messages";
import { NOTHING_SELECTED, document_, errors, selection } from "../src/store/state";

/** The page asks the server for landing sites; here a note of what it asked is its only answer. */
const asked: { path: string; body: unknown }[] = [];

vi.stubGlobal("document", { documentElement: { dataset: {} } });
vi.stubGlobal("WebSocket", { OPEN: 1 });
vi.stubGlobal("location", { protocol: "http:", host: "test" });
vi.stubGlobal("fetch", (path: string, init: RequestInit) => {
  asked.push({ path, body: JSON.parse(String(init.body)) });
  return Promise.resolve(new Response("{}"));
});

const { aim, findSites, pointOut, rotorSpan_m, span_m } = await import("../src/traversability/ground_orders");
const { places } = await import("../src/traversability/places");

const PLACE = { lat_deg: 37.73, lon_deg: 14.99 };
const told = (fields: Partial<SelectionDoc>) => (selection.value = { ...NOTHING_SELECTED, ...fields });

beforeEach(() => {
  told({});
  asked.length = 0;
  rotorSpan_m.value = null;
  document_.value = { profile: { radius_m: 0.35 }, pois: [], home: null } as unknown as PlanDoc;
});

describe("landing sites by a click", () => {
  it("are asked for by the page that has the tool in hand, once", () => {
    aim();
    expect(selection.value.tool).toBe("landing");
    told({ place: PLACE });
    told({ place: PLACE, poi_id: "p1" });
    expect(asked).toEqual([
      { path: "/api/traversability/sites", body: { ...PLACE, rotor_span_m: 0.7, radius_m: 150 } },
    ]);
  });

  it("are not asked for by other pages, which are told of the click as well", () => {
    told({ tool: "landing" });
    told({ place: PLACE });
    expect(asked).toEqual([]);
  });

  it("are not asked for when the tool is put down without a click", () => {
    aim();
    told({});
    told({ place: PLACE });
    expect(asked).toEqual([]);
  });
});

describe("a site that is pointed out", () => {
  it("is told to the 3D view, and is forgotten when other sites are looked for", async () => {
    pointOut(3);
    expect(selection.value.site_rank).toBe(3);
    await findSites(PLACE);
    expect(selection.value.site_rank).toBeNull();
  });
});

describe("the rotor span", () => {
  it("is that of the plan's vehicle until the operator sets it, within what the server takes", () => {
    expect(span_m()).toBeCloseTo(0.7);
    rotorSpan_m.value = 2.4;
    expect(span_m()).toBe(2.4);
    rotorSpan_m.value = null;
    document_.value = { profile: { radius_m: 20 } } as unknown as PlanDoc;
    expect(span_m()).toBe(10);
  });

  it("goes with every question", async () => {
    rotorSpan_m.value = 1.2;
    await findSites(PLACE);
    expect(asked[0]?.body).toMatchObject({ rotor_span_m: 1.2 });
    expect(errors.value["landing"]).toBeUndefined();
  });
});

describe("the places to ask for", () => {
  const plan = {
    home: null,
    pois: [
      { id: "a", name: "Meadow", ...PLACE },
      { id: "b", name: "", lat_deg: 37.74, lon_deg: 15 },
    ],
  } as unknown as PlanDoc;

  it("are home or else the first point, the selected point, and the vehicle if there is one", () => {
    told({ poi_id: "b" });
    const [home, point, vehicle] = places(plan);
    expect(home?.place).toMatchObject(PLACE);
    expect(point).toMatchObject({ label: "Point 2", place: { lat_deg: 37.74 } });
    expect(vehicle).toMatchObject({ place: null, why: "No vehicle is connected" });
  });

  it("say why they cannot be asked for", () => {
    const all = places({ ...plan, pois: [] });
    expect(all.map(({ place }) => place)).toEqual([null, null, null]);
    expect(all.every(({ why }) => why !== "")).toBe(true);
  });
});
