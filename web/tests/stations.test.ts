import { beforeEach, describe, expect, test } from "vitest";
import type { OtherVehicleDoc, StationsMessage } from "../src/messages";
import { receive } from "../src/store/reduce";
import { now_ms } from "../src/store/clock";
import { forgetClock, takeClock } from "../src/store/server_clock";
import { forgetStations, isOld, stations, takeStations, words, wrong } from "../src/store/stations";

const bee: OtherVehicleDoc = {
  number: 1,
  name: "Bee",
  age_s: 0.44,
  is_old: false,
  lat_deg: 47,
  lon_deg: 8,
  alt_rel_home_m: 30.4,
  alt_amsl_m: 530,
  alt_surface_m: 12.4,
  ground_speed_m_s: 5.25,
  in_charge: "Anna",
  in_charge_silent: false,
  mode: "AUTO",
  phase: "flying",
  armed: true,
  in_air: true,
  link: "live",
  battery_share: 0.634,
  battery: "63 %, 12 min to the reserve",
  plan: "Ridge",
  plan_share: 0.5,
  text: "",
};

const told = (vehicles: OtherVehicleDoc[], more: Partial<StationsMessage> = {}): StationsMessage => ({
  v: 1,
  type: "stations",
  now_mono_s: 500,
  old_s: 3,
  station: "Alpha",
  router: "connected",
  text: "",
  stations: [
    { name: "Bravo", state: "live", silent_s: 0.2, round_trip_s: 0.4, clock_ahead_s: 0, text: "", vehicles },
  ],
  refused: 0,
  ...more,
});

beforeEach(() => {
  forgetStations();
  forgetClock();
});

describe("other stations' vehicles", () => {
  test("age and height come first, each with its unit and from where it counts", () => {
    expect(words(bee)).toBe(
      "0.4\u00a0s old · 12\u00a0m above ground · Anna in charge · 5.3\u00a0m/s · AUTO · armed · under way · 63 %",
    );
    expect(words({ ...bee, alt_surface_m: null })).toContain("30\u00a0m above its home");
    expect(words({ ...bee, alt_surface_m: null, alt_rel_home_m: null })).toContain("530\u00a0m AMSL");
    expect(words({ ...bee, alt_surface_m: null, alt_rel_home_m: null, alt_amsl_m: null })).toContain(
      "height ?",
    );
  });

  test("what is not known is not shown as fresh", () => {
    expect(words({ ...bee, age_s: null })).toContain("age ?");
    expect(words({ ...bee, age_s: null, lat_deg: null })).toContain("no position");
    expect(words({ ...bee, age_s: 31.6 })).toContain("32\u00a0s old");
  });

  test("who is in charge is told as its own station tells it", () => {
    expect(words({ ...bee, in_charge: "" })).toContain("nobody in charge");
    expect(words({ ...bee, in_charge_silent: true })).toContain("Anna in charge, not heard there");
    expect(words({ ...bee, phase: "idle", battery_share: null })).toMatch(/ · armed$/);
  });

  test("ages go on while nothing comes, and count what waited on a slow line", () => {
    now_ms.value = 10_000;
    takeStations(told([bee]), 10_000);
    expect([words(bee).slice(0, 3), isOld(bee)]).toEqual(["0.4", false]);
    now_ms.value = 12_000;
    expect([words(bee).slice(0, 3), isOld(bee)]).toEqual(["2.4", false]);
    now_ms.value = 13_000;
    expect([words(bee).slice(0, 3), isOld(bee)]).toEqual(["3.4", true]);
    // Just come, and told 4 s ago by the server's clock, which is known to 0.1 s.
    takeClock({ v: 1, type: "clock", page_ms: 12_800, now_mono_s: 504 }, 13_000);
    takeStations(told([bee]), 13_000);
    expect([words(bee).slice(0, 3), isOld(bee)]).toEqual(["4.6", true]);
    expect(words({ ...bee, age_s: null })).toContain("age ?");
  });

  test("what is wrong is told, the way to all of them first", () => {
    receive(
      told([{ ...bee, text: "Not seen for 45 s." }], { text: "The router does not answer.", router: "lost" }),
    );
    expect(wrong.value).toEqual(["The router does not answer.", "Bee (Bravo 1): Not seen for 45 s."]);
    // Of a lost station its own sentence is enough.
    const lost = told([{ ...bee, text: "Not seen." }]);
    lost.stations[0] = { ...lost.stations[0]!, state: "lost", text: "Bravo is not heard." };
    receive(lost);
    expect(wrong.value).toEqual(["Bravo is not heard."]);
    receive(told([bee]));
    expect(wrong.value).toEqual([]);
    expect(stations.value?.stations[0]?.vehicles).toEqual([bee]);
  });
});
