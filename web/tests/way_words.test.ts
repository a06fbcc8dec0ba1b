import { describe, expect, it } from "vitest";
import type { WayStatus } from "../src/messages";
import {
  ageWord,
  hasAnotherWay,
  lossWord,
  roundTripWord,
  signalTitle,
  signalWord,
  wayInUse,
} from "../src/vehicle/way_words";

const way = (fields: Partial<WayStatus> = {}): WayStatus => ({
  address: "udpin:0.0.0.0:14550",
  peer: "10.0.0.2:4000",
  identity: "known",
  in_use: true,
  silent_s: 0.12,
  quality: 0.93,
  round_trip_s: 0.0424,
  signal: null,
  ...fields,
});

const RADIO = "/dev/ttyUSB0:57600";

describe("the figures of a way", () => {
  it("carry their units, and a dash where nothing is known", () => {
    const words = [lossWord(way()), roundTripWord(way()), ageWord(way(), 0.5)];
    expect(words.map((word) => word.replace(/\s/gu, " "))).toEqual(["7 %", "42 ms", "0.6 s"]);
    const silent = way({ silent_s: null, quality: null, round_trip_s: null });
    expect([lossWord(silent), roundTripWord(silent), ageWord(silent, 3)]).toEqual(["–", "–", "–"]);
  });

  it("show the signal of both ends", () => {
    const radio = way({ signal: { rssi: 188, noise: 40, remote_rssi: 255, remote_noise: 45 } });
    expect(signalWord(radio)).toBe("188 / –");
    expect(signalTitle(radio)).toContain("188 over noise 40");
    expect(signalWord(way())).toBe("–");
  });
});

describe("which way is in use", () => {
  it("is said where there are several", () => {
    expect(wayInUse([way()])).toBe("");
    expect(wayInUse([way({ in_use: false }), way({ address: RADIO })])).toBe(`over ${RADIO}`);
  });
});

describe("a way may be taken away in flight", () => {
  const spare = way({ address: RADIO, in_use: false });
  it("while another one is heard", () => {
    expect(hasAnotherWay([way(), spare], RADIO)).toBe(true);
    expect(hasAnotherWay([way(), spare], "tcp:10.0.0.7:5760")).toBe(false);
  });

  it.each([{ identity: "asked" as const }, { silent_s: 2 }, { silent_s: null }])(
    "not with %o alone",
    (bad) => {
      expect(hasAnotherWay([way(), { ...spare, ...bad }], way().address)).toBe(false);
    },
  );

  it("not when it is the only one", () => {
    expect(hasAnotherWay([way()], way().address)).toBe(false);
  });
});
