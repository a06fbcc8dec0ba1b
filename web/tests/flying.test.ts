import { beforeEach, describe, expect, it } from "vitest";
import { now_ms } from "../src/store/clock";
import {
  adopted,
  flight,
  hasLinkFailed,
  heard,
  isInAir,
  latched,
  lease,
  health,
  linkState,
  overdue_s,
  linkStatus,
  nodes,
  silence_s,
  takeFlying,
  texts,
  trackVersion,
  tracks,
  vehicle,
} from "../src/store/flying";
import { emptyTrack, extend, trackFrom } from "../src/store/track";
import { LOST_S, type TrackDoc } from "../src/messages";
import { follow, linkStatus as link, vehicleMessage, vehicleState } from "./flight_samples";

beforeEach(() => {
  now_ms.value = 0;
  linkStatus.value = null;
  heard.live.value = heard.replay.value = null;
  texts.value = [];
  tracks.live = emptyTrack();
});

describe("what is heard of the vehicle", () => {
  it("is kept apart from what is replayed", () => {
    takeFlying(vehicleMessage(), 1);
    takeFlying(vehicleMessage({ source: "replay", state: vehicleState({ mode: "RTL" }) }), 2);
    expect(heard.live.value?.message.state?.mode).toBe("AUTO");
    expect(heard.replay.value?.message.state?.mode).toBe("RTL");
  });

  it("is the commanded vehicle's only while one is adopted", () => {
    takeFlying(vehicleMessage(), 1);
    expect([adopted.value, vehicle.value]).toEqual([null, null]);
    takeFlying({ v: 1, type: "link", link: link() }, 1);
    expect(vehicle.value?.mode).toBe("AUTO");
  });

  it("says whether it flies, also for autopilots that do not tell", () => {
    takeFlying({ v: 1, type: "link", link: link() }, 1);
    takeFlying(vehicleMessage({ state: vehicleState({ landed: "on_ground" }) }), 1);
    expect(isInAir.value).toBe(false);
    takeFlying(vehicleMessage({ state: vehicleState({ landed: "taking_off" }) }), 1);
    expect(isInAir.value).toBe(true);
    takeFlying(vehicleMessage({ state: vehicleState({ landed: null }) }), 1);
    flight.live.value = null;
    takeFlying({ v: 1, type: "flight", source: "live", flight: { phase: "flying" } as never }, 1);
    expect(isInAir.value).toBe(true);
    takeFlying(vehicleMessage({ state: vehicleState({ armed: false }) }), 1);
    expect(isInAir.value).toBe(false);
  });

  it("falls silent by this page's clock too", () => {
    takeFlying({ v: 1, type: "link", link: link({ state: "lost", silent_s: 12 }) }, 1000);
    now_ms.value = 4500;
    expect(silence_s.value).toBeCloseTo(15.5);
  });

  it("keeps its words, and those of a recording not", () => {
    takeFlying({ v: 1, type: "text", source: "live", text: { t_utc_s: 1, severity: 2, text: "Bad" } }, 1);
    takeFlying({ v: 1, type: "text", source: "replay", text: { t_utc_s: 2, severity: 2, text: "Old" } }, 1);
    expect(latched.value.map((entry) => entry.text)).toEqual(["Bad"]);
  });

  it("comes with who is in charge", () => {
    takeFlying({ v: 1, type: "lease", lease: { ...lease.value, holder: "Anna" } }, 1);
    expect(lease.value).toMatchObject({ holder: "Anna", mine: false });
  });
});

describe("the flown path", () => {
  const doc: TrackDoc = {
    source: "live",
    s_m: [0, 1],
    alt_rel_home_m: [5, 6],
    cross_track_m: [0, 0],
    t_s: [0, 2],
  };

  it("goes on from what the server sent, on one clock", () => {
    const track = trackFrom(doc);
    expect(extend(track, vehicleMessage({ now_mono_s: 500, follow: follow({ s_m: 3 }) }))).toBe(false);
    expect(extend(track, vehicleMessage({ now_mono_s: 500.5, follow: follow({ s_m: 4 }) }))).toBe(true);
    expect(track.t_s.at(-1)).toBeCloseTo(2.5);
    expect(track.s_m.at(-1)).toBe(4);
  });

  it("is not extended on the ground, off the plan, or twice in a moment", () => {
    const track = emptyTrack();
    expect(extend(track, vehicleMessage({ state: vehicleState({ armed: false }) }))).toBe(false);
    expect(extend(track, vehicleMessage({ follow: null }))).toBe(false);
    expect(extend(track, vehicleMessage({ follow: follow({ s_m: null }) }))).toBe(false);
    expect(extend(track, vehicleMessage({ now_mono_s: 10 }))).toBe(true);
    expect(extend(track, vehicleMessage({ now_mono_s: 10.05 }))).toBe(false);
    expect(track.s_m).toHaveLength(1);
  });

  it("has no line over a time in which the vehicle was lost, also once it is thinned", () => {
    const track = emptyTrack();
    const at = (now_mono_s: number, position_t_mono_s: number, s_m: number) =>
      extend(
        track,
        vehicleMessage({ now_mono_s, state: vehicleState({ position_t_mono_s }), follow: follow({ s_m }) }),
      );
    at(0, 0, 1);
    at(LOST_S, LOST_S, 2);
    // The state is told again while nothing new is known of it.
    for (let now_s = LOST_S + 1; now_s < 20; now_s++) at(now_s, LOST_S, 2);
    expect(at(20, 20, 30)).toBe(true);
    at(21, 21, 31);
    expect(new Set(track.s_m)).toEqual(new Set([1, 2, null, 30, 31]));
    expect(track.s_m.indexOf(null)).toBe(track.s_m.indexOf(30) - 1);
    expect(track.alt_rel_home_m[track.s_m.indexOf(null)]).toBeNull();
    for (let index = 22; index < 12_022; index++) at(index, index, index);
    expect(track.s_m.length).toBeLessThan(7000);
    expect(track.s_m.filter((s_m) => s_m === null)).toHaveLength(1);
  });

  it("is replaced by a new one, which the charts notice", () => {
    takeFlying(vehicleMessage(), 1);
    const before = trackVersion.live.value;
    takeFlying({ v: 1, type: "track", track: doc }, 1);
    expect(tracks.live.s_m).toEqual([0, 1]);
    expect(trackVersion.live.value).toBe(before + 1);
  });

  it("is thinned, not cut, when it gets long", () => {
    const track = emptyTrack();
    for (let index = 0; index < 12_001; index++) extend(track, vehicleMessage({ now_mono_s: index }));
    expect(track.t_s.length).toBeLessThan(7000);
    expect(track.t_s[0]).toBe(0);
    expect(track.s_m).toHaveLength(track.t_s.length);
  });
});

describe("health", () => {
  it("is kept apart for the vehicle and for a recording", () => {
    const row = { code: "wind", level: "good", value: "2.0 m/s", limit: "", text: "" } as const;
    takeFlying({ v: 1, type: "health", source: "live", rows: [row] }, 0);
    expect([health.live.value, health.replay.value]).toEqual([[row], []]);
    takeFlying({ v: 1, type: "health", source: "live", rows: [] }, 0);
    expect(health.live.value).toEqual([]);
  });
});

describe("a link process that fails", () => {
  beforeEach(() => {
    takeFlying({ v: 1, type: "link", link: link({ silent_s: 0.1 }) }, 0);
    nodes.value = [{ name: "link", state: "running", restarts: 0, text: "" }];
  });

  it("says of the vehicle's connection what it last said: that nothing comes here is the page's own trouble", () => {
    expect([linkState.value, overdue_s.value]).toEqual(["live", 0]);
    now_ms.value = 6000;
    expect([linkState.value, overdue_s.value]).toEqual(["live", 5]);
    expect(silence_s.value).toBeCloseTo(6.1);
    takeFlying({ v: 1, type: "link", link: link({ silent_s: 1.8 }) }, 6000);
    now_ms.value = 6900;
    expect([linkState.value, overdue_s.value]).toEqual(["stale", 0]);
    takeFlying({ v: 1, type: "link", link: link({ silent_s: 3.8 }) }, 6900);
    now_ms.value = 7700;
    expect(linkState.value).toBe("lost");
  });

  it.each(["silent", "restarting"] as const)("has failed while it is %s", (state) => {
    expect(hasLinkFailed.value).toBe(false);
    nodes.value = [{ name: "link", state, restarts: 0, text: "" }];
    expect(hasLinkFailed.value).toBe(true);
    nodes.value = [{ name: "recorder", state, restarts: 0, text: "" }];
    expect(hasLinkFailed.value).toBe(false);
  });
});
