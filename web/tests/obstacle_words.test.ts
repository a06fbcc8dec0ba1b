import { describe, expect, it } from "vitest";
import { withUnit } from "../src/format";
import type { AvoidanceStatus } from "../src/messages";
import {
  avoidanceWords,
  conflictWhere,
  heightDifference,
  lateAlert_s,
  isTooFast,
  offNose,
  seenAgo,
  sensorRow,
  signedHeight,
  spoken,
  timeTo,
} from "../src/obstacles/obstacle_words";
import { withStatus } from "../src/store/sensing";
import { alert, alertDoc, obstacle, perception, perceptionMessage } from "./obstacle_samples";

const plain = (text: string) => text.replace(/\u00a0/g, " ");

describe("an obstacle in words", () => {
  it("says where it is from the nose", () => {
    expect([-3, 0.2, 41, 179.8].map(offNose)).toEqual([
      "3° left",
      "dead ahead",
      "41° right",
      "straight behind",
    ]);
  });

  it("says how much higher or lower it is, with words and with a sign", () => {
    expect([3.2, -1.4, 0.01].map((value) => plain(heightDifference(value)))).toEqual([
      "3.2 m higher",
      "1.4 m lower",
      "at your height",
    ]);
    expect([3.2, -1.4, 0.2].map(signedHeight)).toEqual(["+3", "\u22121", "+0"]);
  });

  it("says when it will be reached, or that it will not", () => {
    expect(plain(timeTo(4.12))).toBe("contact in 4.1 s");
    expect(timeTo(null)).toBe("not getting nearer");
  });

  it("is read out once with what matters", () => {
    expect(plain(spoken(alertDoc("a")))).toBe(
      "Radar: obstacle. 8.6 metres, 3° left, 3.2 m higher, contact in 4.1 s.",
    );
    expect(spoken(alertDoc("a", { over: true }))).toBe("Over. Radar: obstacle.");
    const trouble = alert("b", { sensor: "vision", kind: "divergence", obstacle: null, text: "4 m apart." });
    expect(spoken(alertDoc("b", { alert: trouble }))).toBe("Camera: positions disagree. 4 m apart.");
    const gone = { ...trouble, kind: "avoidance" as const, text: "Take the transmitter." };
    expect(spoken(alertDoc("c", { alert: gone })), "no sensor is to blame").toBe(
      "Avoidance: does not watch. Take the transmitter.",
    );
  });

  it("on the mission ahead says how far, when, and before which item", () => {
    const { lat_deg, lon_deg, enu_m, voxels } = obstacle();
    const conflict = {
      ahead_m: 84,
      time_s: 28,
      item: 14,
      distance_m: 0.8,
      lat_deg: lat_deg ?? 0,
      lon_deg: lon_deg ?? 0,
      enu_m,
      voxels,
      top_unseen: false,
    };
    expect(plain(conflictWhere(conflict))).toBe("in 84 m, 28 s, before item 14");
    expect(plain(conflictWhere({ ...conflict, time_s: null }))).toBe("in 84 m, before item 14");
  });
});

describe("a sensor's row", () => {
  it("says what was refused, and why", () => {
    const status = perception({
      dropped: [
        { what: "too far from any position", count: 3 },
        { what: "not a number", count: 0 },
      ],
      lost_frames: 2,
    });
    const row = sensorRow(withStatus(undefined, perceptionMessage(status), 0));
    expect(row.lost).toBe("3 not used: too far from any position, 2 lost");
    expect(row.reasons).toEqual(["3 × too far from any position"]);
    expect([plain(row.latency), row.rate]).toEqual(["62 ms", "–"]);
  });

  it("says nothing of it where there is nothing to say", () => {
    expect(sensorRow(withStatus(undefined, perceptionMessage(perception()), 0)).lost).toBe("");
  });
});

describe("avoidance", () => {
  const status = (fields: Partial<AvoidanceStatus>): AvoidanceStatus => ({
    enabled: true,
    state: "watching",
    text: "",
    height_offset_m: 0,
    largest_speed_m_s: null,
    by: "climb",
    sensors: [],
    eyes: [],
    ...fields,
  });

  it("says its state, how much higher it flies, and what the server adds", () => {
    expect(avoidanceWords(status({})).word).toBe("Watching");
    const climbing = avoidanceWords(status({ state: "climbing", height_offset_m: 4, text: "Over a crane." }));
    expect(plain(climbing.word)).toBe("Climbing +4.0 m");
    expect([climbing.level, climbing.note]).toEqual(["near", "Over a crane."]);
    expect(avoidanceWords(status({ state: "ceiling" })).level).toBe("bad");
    expect(avoidanceWords(status({ state: "offset", height_offset_m: 8.1 })).word).toMatch(/^Higher \+8\.1/);
    expect(avoidanceWords(status({ state: "offset" })).word).toBe("New line");
  });

  it("warns of a speed that the region does not suffice for", () => {
    const limited = status({ largest_speed_m_s: 4 });
    expect([3.9, 4.0, 4.2, null].map((speed) => isTooFast(limited, speed))).toEqual([
      false,
      false,
      true,
      false,
    ]);
    expect(isTooFast({ ...limited, enabled: false }, 9)).toBe(false);
  });
});

describe("what is not told again", () => {
  it("is shown with its age, and nothing is late by a clock that nobody knows", () => {
    const old = alert("a", { t_mono_s: 100 });
    expect(lateAlert_s(old, null)).toBeNull();
    expect(lateAlert_s(old, 101.5)).toBeNull();
    expect(lateAlert_s(old, 140)).toBe(40);
    expect(seenAgo(40)).toBe(`${withUnit(40, "s")} ago`);
    expect(seenAgo(null)).toBe("not now");
  });
});
