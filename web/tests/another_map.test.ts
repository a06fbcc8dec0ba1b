import { describe, expect, it } from "vitest";
import { beginsAnew, differing } from "../src/obstacles/another_map";
import { obstacles } from "../src/store/obstacles";

const settings = obstacles.live.peek().settings;

describe("another map", () => {
  it("asks only for what is another value", () => {
    expect(differing({}, settings)).toEqual({});
    expect(differing({ radar_resolution_m: settings.radar_resolution_m }, settings)).toEqual({});
    expect(differing({ radar_resolution_m: 0.5, memory_limit_bytes: 1e9 }, settings)).toEqual({
      radar_resolution_m: 0.5,
    });
  });

  it("says before which maps begin anew", () => {
    expect(beginsAnew({})).toBe("");
    expect(beginsAnew({ position_error_m: 3 })).toBe("");
    expect(beginsAnew({ radar_resolution_m: 0.5 })).toMatch(/^The radar's map begins anew/);
    expect(beginsAnew({ vision_resolution_m: 0.3 })).toMatch(
      /^The camera's and range finder's maps begin anew/,
    );
    expect(beginsAnew({ memory_limit_bytes: 2e9 })).toMatch(
      /^The radar's, camera's and range finder's maps begin anew/,
    );
  });
});
