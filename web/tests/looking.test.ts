import { expect, test } from "vitest";
import type { RadarTargetsDoc, SectionDoc } from "../src/messages";
import { px, sectionFrame, targetsReach_m, ticks } from "../src/obstacles/looking";

const section = (fields: Partial<SectionDoc> = {}): SectionDoc => ({
  text: "",
  across: false,
  thickness_m: 4,
  reach_m: 40,
  vehicle_up_m: 5,
  heading_deg: 0,
  ground_s_m: [-40, 0, 40],
  ground_up_m: [-2, 0, 2],
  maps: [],
  ...fields,
});

test("axes have round figures that do not crowd", () => {
  expect(ticks(-40, 40, 4, 50)).toEqual([-40, -20, 0, 20, 40]);
  expect(ticks(-3, 7, 20, 36)).toEqual([-2, 0, 2, 4, 6]);
  expect(ticks(0.1, 0.2, 1, 50)).toEqual([]);
});

test("a metre is as long up as ahead, and the vehicle and its ground are in the picture", () => {
  const doc = section();
  for (const up of [0.5, 5, 30, 120]) {
    const frame = sectionFrame({ ...doc, vehicle_up_m: up }, 260, 220);
    const [x, y] = px(frame, 0, up);
    expect(x).toBe(130);
    expect(y).toBeGreaterThan(20);
    expect(y).toBeLessThan(200);
    expect(px(frame, 10, up)[0] - x).toBeCloseTo(y - px(frame, 0, up + 10)[1]);
  }
  const low = sectionFrame(doc, 260, 220);
  expect(px(low, 0, 0)[1]).toBeLessThan(220);
  expect(sectionFrame(section({ ground_up_m: [null, null, null] }), 260, 220).scale).toBe(low.scale);
});

test("the radar's picture reaches to the farthest kept target", () => {
  const doc = { ahead_m: [12, 90, 30], kept: [true, false, true] } as RadarTargetsDoc;
  expect(targetsReach_m(doc)).toBe(40);
  expect(targetsReach_m({ ...doc, kept: [true, true, true] })).toBe(125);
  expect(targetsReach_m({ ...doc, kept: [false, false, false] })).toBe(10);
});
