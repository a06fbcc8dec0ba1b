import { beforeEach, describe, expect, it } from "vitest";
import type { Aircraft, AlertDoc, TrafficMessage, TrafficSettings, TrafficStatus } from "../src/messages";
import { inOrder } from "../src/store/alerts";
import { now_ms } from "../src/store/clock";
import { receive } from "../src/store/reduce";
import { forgetTraffic, hasTraffic, isSilent, sinceTold_s, traffic } from "../src/store/traffic";
import { alertSensor, alertTitle, spoken } from "../src/obstacles/obstacle_words";
import { aircraftWords, away, closing, height, leftOut, oClock } from "../src/traffic/traffic_words";
import { alert } from "./obstacle_samples";

const plain = (text: string) => text.replace(/[\u00a0\u202f]/g, " ");

const SETTINGS: TrafficSettings = {
  warn_distance_m: 9260,
  warn_height_m: 300,
  look_ahead_s: 60,
  show_distance_m: 37040,
  show_height_m: 3000,
  own_icao: "",
  own_id: "",
};

function aircraft(fields: Partial<Aircraft> = {}): Aircraft {
  return {
    key: "adsb 4b1805",
    source: "adsb",
    name: "HBABC",
    kind: "light",
    trust: "other",
    on_ground: false,
    emergency: false,
    lat_deg: 47,
    lon_deg: 8,
    age_s: 1,
    within_m: 210,
    velocity_enu_m_s: [-40, 0],
    climb_m_s: 0,
    alt_m: 580,
    alt_datum: "gnss",
    distance_m: 1240,
    bearing_deg: 62,
    height_m: 80,
    height_within_m: 40,
    closing_m_s: 40,
    closest_m: 310,
    closest_in_s: 35,
    conflict: true,
    operator_deg: null,
    ...fields,
  };
}

function status(fields: Partial<TrafficStatus> = {}): TrafficStatus {
  return {
    state: "watching",
    text: "",
    t_mono_s: 100,
    t_utc_s: 1000,
    heard: 1,
    aircraft: [aircraft()],
    hidden: 0,
    filtered: 0,
    crowded_out: 0,
    settings: SETTINGS,
    ...fields,
  };
}

const message = (of: TrafficStatus | null, source: "live" | "replay" = "live"): TrafficMessage => ({
  v: 1,
  type: "traffic",
  source,
  now_mono_s: 100,
  settings: SETTINGS,
  status: of,
});

beforeEach(() => {
  forgetTraffic("live");
  forgetTraffic("replay");
  now_ms.value = performance.now();
});

describe("traffic", () => {
  it("is kept for each source; settings are known before anything is heard", () => {
    receive(message(null));
    receive(message(status(), "replay"));
    expect([hasTraffic.live.value, hasTraffic.replay.value]).toEqual([false, true]);
    expect(traffic.live.value?.settings.warn_distance_m).toBe(9260);
  });

  it("is silent, and older, when the server says nothing; a recording is never", () => {
    const known = { settings: SETTINGS, status: status(), received_ms: now_ms.value - 4000 };
    expect([isSilent(known, "live"), isSilent(known, "replay")]).toEqual([true, false]);
    expect([sinceTold_s(known, "live"), sinceTold_s(known, "replay")]).toEqual([4, 0]);
  });

  it("is told in the words of pilots", () => {
    expect([oClock(62, 0), oClock(0, 0), oClock(350, 10), oClock(20, 350), oClock(7, null)]).toEqual([
      "2 o'clock",
      "12 o'clock",
      "11 o'clock",
      "1 o'clock",
      "bearing 007°",
    ]);
    expect([away(433), away(996), away(1240), away(14_200), away(null)].map(plain)).toEqual([
      "430 m",
      "1.0 km",
      "1.2 km",
      "14 km",
      "place ?",
    ]);
    expect(plain(closing(aircraft()))).toBe("closing 35 s");
    expect(closing(aircraft({ closing_m_s: -2 }))).toBe("going away");
    expect(closing(aircraft({ closing_m_s: null }))).toBe("course ?");
    expect(closing(aircraft({ closest_in_s: 900 }))).toBe("closing");
  });

  it("says when a height is unknown, or may be on the other side", () => {
    expect(plain(height(aircraft()))).toBe("+80 m");
    expect(plain(height(aircraft({ height_m: -120, height_within_m: 600 })))).toBe("\u2212120 m ?");
    expect(height(aircraft({ height_m: null }))).toBe("unknown");
    const words = aircraftWords(aircraft({ height_m: null }), 0, 0);
    expect(words).toContain("height unknown: counts as yours");
  });

  it("names the datum, the age and what it is taken for", () => {
    const words = plain(aircraftWords(aircraft({ alt_datum: "pressure", trust: "echo" }), 0, 6));
    expect(words).toContain("HBABC, light (ADS-B): 2 o'clock; 1.2 km; 80 m above, by pressure, within 40 m");
    expect(words).toContain("closing at 40 m/s, closest 310 m in 35 s");
    expect(words).toContain("own transponder: not warned of");
    expect(words).toContain("heard 7 s ago, within 210 m");
    expect(aircraftWords(aircraft({ bearing_deg: null, distance_m: null }), 0, 0)).toContain(
      "your own position is unknown",
    );
  });

  it("counts what is left out", () => {
    expect(leftOut(status(), 1)).toBe("");
    expect(leftOut(status({ hidden: 4, filtered: 2, crowded_out: 9 }), 1)).toBe(
      "And 4 more, 2 too far or high to show, 9 farther ones not kept.",
    );
  });

  it("warns as itself, after what is seconds away", () => {
    const warned = alert("traffic-1", {
      sensor: "traffic",
      kind: "traffic",
      text: "Traffic",
      obstacle: null,
    });
    expect([alertSensor(warned), alertTitle(warned)]).toEqual([null, "Traffic: may come too near"]);
    const doc = (of: typeof warned, began_utc_s: number): AlertDoc => ({
      alert: of,
      began_utc_s,
      over: false,
      acknowledged: false,
    });
    expect(spoken(doc(warned, 1))).toBe("Traffic: may come too near. Traffic");
    const collision = alert("t7", { kind: "approach", obstacle: null });
    expect(inOrder([doc(warned, 1), doc(collision, 2)]).map((entry) => entry.alert.id)).toEqual([
      "t7",
      "traffic-1",
    ]);
  });
});
