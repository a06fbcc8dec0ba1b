import { describe, expect, it } from "vitest";
import {
  RADIUS,
  RANGES_M,
  blips,
  groundDistance_m,
  labelled,
  nearestOf,
  nextRange,
  place,
  rings,
  sector,
  sweepArcs,
} from "../src/obstacles/polar";
import { obstacle, perception } from "./obstacle_samples";

const REGION = {
  enu_m: [0, 0, 20] as [number, number, number],
  heading_rad: 0,
  depth_m: 10,
  fov_rad: Math.PI / 2,
  height_m: 2,
  occupied: false,
  nearest_m: 1.5,
  hidden_m: null,
};

const sweep = (fields: Record<number, number>) =>
  Array.from({ length: 72 }, (_, index) => fields[index] ?? null);

describe("the polar display", () => {
  it("has the nose up and starboard to the right", () => {
    expect(place(0, 10).y).toBeCloseTo(-10);
    expect(place(90, 10).x).toBeCloseTo(10);
    expect(place(-90, 10).x).toBeCloseTo(-10);
    expect(place(180, 10).y).toBeCloseTo(10);
  });

  it("has rings at round distances, the last one at the rim", () => {
    for (const range_m of RANGES_M) {
      const all = rings(range_m);
      expect(all.at(-1)).toBe(range_m);
      expect(all.every((ring_m) => ring_m * 2 === Math.round(ring_m * 2))).toBe(true);
    }
    expect(rings(120)).toEqual([40, 80, 120]);
  });

  it("changes its range in steps and stops at the ends", () => {
    expect([nextRange(20, -1), nextRange(20, 1)]).toEqual([10, 40]);
    expect([nextRange(10, -1), nextRange(120, 1)]).toEqual([null, null]);
  });

  it("draws the nearest of each direction, nothing beyond the rim", () => {
    const arcs = sweepArcs(sweep({ 0: 10, 18: 5, 36: 30 }), 20);
    expect(arcs.map((arc) => arc.distance_m)).toEqual([10, 5]);
    // The first is centred on the nose: it begins left of it.
    expect(arcs[0]?.path).toMatch(/^M-2\.1 -48\.0A48\.0/);
  });

  it("draws the region by its width, cut at the rim", () => {
    expect(sector(REGION, 20)).toMatch(/^M0 0L-33\.9 -33\.9A48\.0/);
    expect(sector({ ...REGION, depth_m: 100 }, 20)).toContain(`A${RADIUS}.0`);
  });

  it("places obstacles over the ground, not by their distance in space", () => {
    const high = obstacle({ distance_m: 13, enu_m: [0, 5, 32], off_nose_deg: 0 });
    expect(groundDistance_m(high, REGION)).toBeCloseTo(5);
    expect(groundDistance_m(high, null)).toBe(13);
    const [blip] = blips(perception({ region: REGION, obstacles: [high] }), 20);
    expect(blip).toMatchObject({ isBeyond: false });
    expect(blip?.y).toBeCloseTo(-RADIUS / 4);
  });

  it("keeps what lies beyond at the rim, marked", () => {
    const far = obstacle({ distance_m: 33, off_nose_deg: 90 });
    const [blip] = blips(perception({ obstacles: [far] }), 20);
    expect(blip).toMatchObject({ isBeyond: true });
    expect(blip?.x).toBeCloseTo(RADIUS);
  });

  it("writes heights beside a few, the nearest first, none over another", () => {
    const at = (x: number, y: number) => ({ x, y });
    expect(labelled([at(0, 0), at(3, 3), at(60, 0)])).toEqual([at(0, 0), at(60, 0)]);
    expect(labelled([0, 20, 40, 60, 80].map((y) => at(0, y)))).toHaveLength(4);
  });
});

describe("the nearest thing around", () => {
  it("is that of any sensor, in a region or not", () => {
    const radar = perception({ sweep_m: sweep({ 54: 6 }), obstacles: [obstacle()] });
    expect(nearestOf([radar])).toEqual({ distance_m: 6, off_nose_deg: -90 });
    const vision = perception({
      sensor: "vision",
      obstacles: [obstacle({ distance_m: 2, off_nose_deg: 4 })],
    });
    expect(nearestOf([radar, vision])).toEqual({ distance_m: 2, off_nose_deg: 4 });
  });

  it("is none where nothing was seen", () => {
    expect(nearestOf([perception()])).toBeNull();
    expect(nearestOf([])).toBeNull();
  });
});
