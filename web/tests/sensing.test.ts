import { beforeEach, describe, expect, it } from "vitest";
import { aheadOf } from "../src/obstacles/ahead";
import { now_ms } from "../src/store/clock";
import {
  alerts,
  hasSensors,
  isAlarming,
  obstacles,
  sensed,
  takeSensing,
  watching,
} from "../src/store/obstacles";
import { sightAge_s, silence_s, watchOf, withStatus, type Sensed } from "../src/store/sensing";
import { alert, alertDoc, obstaclesState, perception, perceptionMessage } from "./obstacle_samples";

beforeEach(() => {
  now_ms.value = 0;
  sensed.live.value = new Map();
  sensed.replay.value = new Map();
  obstacles.live.value = obstacles.replay.value = obstaclesState();
});

function played(frames: readonly [t_mono_s: number, frames: number][]): Sensed {
  let known: Sensed | undefined;
  for (const [t_mono_s, count] of frames) {
    known = withStatus(known, perceptionMessage(perception({ t_mono_s, frames: count })), 0);
  }
  if (!known) throw new Error("nothing was played");
  return known;
}

describe("a sensor's rate", () => {
  it("is unknown at first, then counted by its own clock", () => {
    expect(played([[100, 1]]).rate_hz).toBeNull();
    const steady = Array.from({ length: 40 }, (_, index): [number, number] => [100 + index / 10, index]);
    expect(played(steady).rate_hz).toBeCloseTo(10);
  });

  it("falls to nothing when frames stop but the node still speaks", () => {
    expect(
      played([
        [100, 5],
        [101, 5],
        [102, 5],
        [103, 5],
      ]).rate_hz,
    ).toBe(0);
  });

  it("begins anew after a recording was wound back or a node restarted", () => {
    expect(
      played([
        [100, 50],
        [101, 60],
        [40, 3],
      ]).rate_hz,
    ).toBeNull();
    expect(
      played([
        [100, 50],
        [101, 60],
        [102, 2],
      ]).rate_hz,
    ).toBeNull();
  });
});

describe("what may be relied on", () => {
  const entry = withStatus(undefined, perceptionMessage(perception()), 1000);

  it("is not a node that has fallen silent, whatever it said last", () => {
    expect(watchOf(entry, true, 2000)).toBe("running");
    expect(watchOf(entry, true, 9000)).toBe("silent");
    expect(silence_s(entry, true, 9000)).toBeCloseTo(8);
  });

  it("stays what it was in a recording that stands still", () => {
    expect(watchOf(entry, false, 9000)).toBe("running");
  });

  it("is only what watches", () => {
    takeSensing(perceptionMessage(perception()), 0);
    takeSensing(perceptionMessage(perception({ sensor: "vision", state: "blind" })), 0);
    expect(watching("live").map((status) => status.sensor)).toEqual(["radar"]);
    now_ms.value = 10_000;
    expect(watching("live")).toEqual([]);
  });
});

describe("messages about obstacles", () => {
  it("are kept by their source, and forgotten when the server says so", () => {
    takeSensing(perceptionMessage(perception()), 0);
    expect([hasSensors.live.value, hasSensors.replay.value]).toEqual([true, false]);
    takeSensing({ ...perceptionMessage(perception()), status: null }, 0);
    expect(hasSensors.live.value).toBe(false);
  });

  it("alarm at once, and no more once they are acknowledged", () => {
    takeSensing({ v: 1, type: "alert", source: "live", alert: alert("a") }, 0);
    expect([isAlarming.value, alerts.live.value.length]).toEqual([true, 1]);
    const seen = obstaclesState({ alerts: [alertDoc("a", { acknowledged: true })] });
    takeSensing({ v: 1, type: "obstacles", source: "live", obstacles: seen }, 0);
    expect([isAlarming.value, alerts.live.value.length]).toEqual([false, 1]);
  });

  it("of a recording alarm nobody", () => {
    takeSensing({ v: 1, type: "alert", source: "replay", alert: alert("a") }, 0);
    expect([isAlarming.value, alerts.replay.value.length]).toEqual([false, 1]);
  });
});

describe("the mission ahead", () => {
  const conflict = (ahead_m: number) => ({
    ahead_m,
    time_s: 28,
    item: 14,
    distance_m: 0.8,
    enu_m: [1, 2, 3] as [number, number, number],
    lat_deg: 37,
    lon_deg: 14,
    voxels: 31,
    top_unseen: false,
  });

  it("meets the first conflict of any sensor", () => {
    const ahead = aheadOf([
      perception({ conflict: conflict(120) }),
      perception({ sensor: "vision", conflict: conflict(30), corridor_m: 31, corridor_occupied: true }),
    ]);
    expect(ahead.conflict).toMatchObject({ ahead_m: 30, sensor: "vision" });
    expect([ahead.corridor_m, ahead.isCorridorOccupied]).toEqual([31, true]);
  });

  it("is not known to be clear when nothing watches", () => {
    expect(aheadOf([])).toEqual({ conflict: null, corridor_m: 0, isCorridorOccupied: false });
  });
});

describe("what a sensor showed last", () => {
  const told = (state: "running" | "stale" | "blind", at_ms: number, before?: Sensed) =>
    withStatus(before, perceptionMessage(perception({ state })), at_ms);

  it("is of now while it watches, and as old as its last word that it did", () => {
    const watches = told("running", 1000);
    expect(sightAge_s(watches, true, 2000)).toBeNull();
    expect(sightAge_s(watches, true, 41_000)).toBe(40);
    const stale = told("stale", 3000, told("stale", 2000, watches));
    expect(sightAge_s(stale, true, 4000)).toBe(3);
    expect(sightAge_s(told("running", 5000, stale), true, 5000)).toBeNull();
  });

  it("has no age where nobody here saw it watch", () => {
    expect(sightAge_s(told("blind", 1000), true, 9000)).toBeNull();
  });
});
