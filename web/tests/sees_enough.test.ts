import { expect, test } from "vitest";
import { slowestOf } from "../src/plan/SeesEnough";
import { obstacles } from "../src/store/obstacles";

const known = { ...obstacles.live.value, sees_enough: { radar: 4.17, vision: 2.94, ranges: 3.1 } };
const eye = {
  sensor: "radar" as const,
  depth_m: 15,
  since_t_mono_s: 0,
  largest_speed_m_s: 6.03,
  is_late: false,
};

test("without a sensor nothing is said", () => {
  expect(slowestOf(known, [])).toBeNull();
});

test("the sensor that sees to stop for least counts, rounded down", () => {
  expect(slowestOf(known, ["radar"])).toEqual({ sensor: "radar", depth_m: 10, speed_m_s: 4.1 });
  expect(slowestOf(known, ["radar", "vision"])).toEqual({ sensor: "vision", depth_m: 7, speed_m_s: 2.9 });
});

test("what eyes have measured counts more than what is set", () => {
  const seeing = { ...known, avoidance: { ...known.avoidance, eyes: [eye] } };
  expect(slowestOf(seeing, ["radar", "vision"])).toEqual({ sensor: "radar", depth_m: 15, speed_m_s: 6 });
});
