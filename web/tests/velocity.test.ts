import { describe, expect, it } from "vitest";
import { RADIUS } from "../src/obstacles/polar";
import {
  conePath,
  conePlace,
  inUrgency,
  leadsInto,
  rimOf,
  speedRings,
  tipOf,
  velocityPlace,
  type Velocity,
} from "../src/tracks/velocity";
import { cone, track } from "./track_samples";

const NORTH_UP = { rim_m_s: 8, heading_deg: 0 };

const corners = (path: string) =>
  [...path.matchAll(/[ML](-?[\d.]+) (-?[\d.]+)/g)].map(([, x, y]) => ({ x: Number(x), y: Number(y) }));

/** Whether a place lies inside a closed path, by the crossings of a ray. */
function holds(path: string, at: { x: number; y: number }): boolean {
  const all = corners(path);
  return all.reduce((inside, a, index) => {
    const b = all[(index + 1) % all.length]!;
    const crosses = a.y > at.y !== b.y > at.y && at.x < a.x + ((at.y - a.y) / (b.y - a.y)) * (b.x - a.x);
    return crosses ? !inside : inside;
  }, false);
}

describe("the velocity display", () => {
  it("has the nose up: flying where the nose points goes up", () => {
    const east: Velocity = [4, 0];
    expect(velocityPlace(east, NORTH_UP).x).toBeCloseTo(RADIUS / 2);
    const heading_east = { ...NORTH_UP, heading_deg: 90 };
    expect(velocityPlace(east, heading_east).y).toBeCloseTo(-RADIUS / 2);
    expect(velocityPlace(east, heading_east).x).toBeCloseTo(0);
  });

  it("has a rim that does not change while the vehicle is near its limit", () => {
    expect(rimOf(8, [0, 0])).toBe(8);
    expect(rimOf(8, [0, 9])).toBe(8);
    expect(rimOf(8, [0, 12])).toBe(15);
    expect(rimOf(0, null)).toBe(2);
    expect(rimOf(200, null)).toBe(40);
  });

  it("has rings at round speeds, the rim last", () => {
    for (const rim of [2, 4, 6, 8, 10, 15, 20, 30, 40]) {
      const all = speedRings(rim);
      expect(all.at(-1)).toBe(rim);
      expect(all.every((ring) => ring * 2 === Math.round(ring * 2))).toBe(true);
    }
  });

  it("ends an arrow at the rim that is too long for it, and says so", () => {
    const tip = tipOf([0, 9], NORTH_UP);
    expect(tip.isBeyond).toBe(true);
    expect(tip.y).toBeCloseTo(-RADIUS);
    expect(tipOf([0, 4], NORTH_UP)).toMatchObject({ isBeyond: false, off_nose_deg: 0 });
  });
});

describe("a collision cone", () => {
  const ahead = cone();

  it("holds the velocities that lead towards the object from where its own velocity is", () => {
    expect(leadsInto(ahead, [0, 4])).toBe(true);
    expect(leadsInto(ahead, [3, 4])).toBe(false);
    expect(leadsInto(ahead, [0, -4])).toBe(false);
    // It flies away as fast: nobody comes nearer.
    expect(leadsInto(cone({ apex_enu_m_s: [0, 5] }), [0, 4])).toBe(false);
    expect(leadsInto(cone({ apex_enu_m_s: [-2, 0], axis_deg: 45, half_angle_deg: 12 }), [0, 2])).toBe(true);
  });

  it("goes through north without a gap", () => {
    const across = cone({ axis_deg: 355, half_angle_deg: 10 });
    expect(leadsInto(across, [0.05, 4])).toBe(true);
    expect(leadsInto(across, [-1.2, 4])).toBe(false);
  });

  it("is half of all velocities, stillness too, once the object is inside the radius", () => {
    const inside = cone({ half_angle_deg: 90 });
    expect(leadsInto(inside, [5, 0.1])).toBe(true);
    expect(leadsInto(inside, [5, -0.1])).toBe(false);
    expect(leadsInto(inside, [0, 0])).toBe(true);
    expect(leadsInto(ahead, [0, 0])).toBe(false);
  });

  it.each([
    [ahead, 0],
    [cone({ apex_enu_m_s: [-2, -1], axis_deg: 60, half_angle_deg: 35 }), 0],
    [cone({ apex_enu_m_s: [1, 0], axis_deg: 200, half_angle_deg: 90 }), 130],
    [cone({ apex_enu_m_s: [-30, 20], axis_deg: 120, half_angle_deg: 8 }), 300],
  ])("is drawn where its velocities are (%#)", (one, heading_deg) => {
    const scale = { rim_m_s: 8, heading_deg };
    const path = conePath(one, scale);
    const speeds = [-7.3, -5.1, -2.7, -0.9, 0.6, 2.3, 4.9, 7.1];
    const all = speeds.flatMap((east) => speeds.map((north): Velocity => [east, north]));
    const within = all.filter(([east, north]) => Math.hypot(east, north) < 8);
    const wrong = within.filter((one_) => holds(path, velocityPlace(one_, scale)) !== leadsInto(one, one_));
    expect(wrong).toEqual([]);
  });

  it("has its number on its axis within the display, or none", () => {
    const at = conePlace(ahead, NORTH_UP);
    expect(at?.x).toBeCloseTo(0);
    expect(at?.y).toBeLessThan(-RADIUS / 2);
    expect(at?.y).toBeGreaterThan(-RADIUS);
    expect(conePlace(cone({ apex_enu_m_s: [20, 0] }), NORTH_UP)).toBeNull();
    expect(conePlace(cone({ apex_enu_m_s: [0, 20] }), NORTH_UP)).toBeNull();
  });
});

describe("the list of moving objects", () => {
  it("begins with what will come too near, then what moves, then what is near", () => {
    const still = track({ id: 1, dangerous: false, moving: false, range_m: 2 });
    const far = track({ id: 2, dangerous: false, range_m: 40 });
    const near = track({ id: 3, dangerous: false, range_m: 10 });
    const danger = track({ id: 4, range_m: 60 });
    expect(inUrgency([still, far, near, danger]).map(({ id }) => id)).toEqual([4, 3, 2, 1]);
  });
});
