import { describe, expect, it } from "vitest";
import { age_s, isStale } from "../src/store/ages";
import { vehicleMessage, vehicleState } from "./flight_samples";

const heard = (fields = {}, received_ms = 5000) => ({ message: vehicleMessage(fields), received_ms });

describe("the age of a value", () => {
  it("is the server's difference and what has passed on this page since", () => {
    expect(age_s(heard(), "position", 5000)).toBeCloseTo(0.2);
    expect(age_s(heard(), "position", 8000)).toBeCloseTo(3.2);
  });

  it("is not known for what was never heard", () => {
    expect(age_s(null, "position", 0)).toBeNull();
    expect(age_s(heard({ state: null }), "position", 0)).toBeNull();
    expect(age_s(heard({ state: vehicleState({ gnss_t_mono_s: null }) }), "gnss", 5000)).toBeNull();
  });

  it("is never negative, whatever the clocks say", () => {
    expect(age_s(heard({ now_mono_s: 99 }), "position", 4000)).toBe(0);
  });

  it("stands still in a recording, where it counts from the newest value", () => {
    const state = vehicleState({ position_t_mono_s: 97, attitude_t_mono_s: 100 });
    const replayed = heard({ source: "replay", now_mono_s: 1e6, state });
    expect(age_s(replayed, "position", 5000)).toBeCloseTo(3);
    expect(age_s(replayed, "position", 60_000)).toBeCloseTo(3);
    expect(age_s(replayed, "attitude", 60_000)).toBe(0);
  });
});

describe("a value", () => {
  it("is stale after 1.5 s", () => {
    expect(isStale(heard(), "attitude", 5000 + 1200)).toBe(false);
    expect(isStale(heard(), "attitude", 5000 + 1400)).toBe(true);
  });

  it("that comes seldom is given its time", () => {
    expect(isStale(heard(), "battery", 5000 + 4000)).toBe(false);
    expect(isStale(heard(), "battery", 5000 + 7000)).toBe(true);
  });

  it("that was never heard is stale", () => {
    expect(isStale(null, "position", 0)).toBe(true);
  });
});
