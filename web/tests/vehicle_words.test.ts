import { describe, expect, it } from "vitest";
import {
  batteryLevel,
  batteryWord,
  fixLevel,
  fixWord,
  linkWords,
  modeWord,
} from "../src/vehicle/vehicle_words";
import { linkStatus, vehicleState } from "./flight_samples";

describe("the status bar", () => {
  it("says mode and item, the item only where one is flown to", () => {
    expect(modeWord(vehicleState())).toBe("AUTO 12/96");
    expect(modeWord(vehicleState({ mode: "LOITER" }))).toBe("LOITER");
    expect(modeWord(vehicleState({ mode: "" }))).toBe("No mode yet");
    expect(modeWord(null)).toBe("–");
  });

  it("says how good the link is, or how long it has been silent", () => {
    expect(linkWords(linkStatus(), 0.1)).toEqual({ text: "98\u00a0%", note: "40\u00a0ms", level: "neutral" });
    expect(linkWords(linkStatus({ state: "lost" }), 12.7)).toEqual({
      text: "Link lost",
      note: "12\u00a0s",
      level: "bad",
    });
    expect(linkWords(linkStatus(), 5.2, "lost").text).toBe("Link lost");
    expect(linkWords(linkStatus(), 1.2, "live", "link")).toEqual({
      text: "Link failed",
      note: "1\u00a0s",
      level: "bad",
    });
    expect(linkWords(linkStatus(), 1.2, "live", "server").text).toBe("No server");
    expect(linkWords(linkStatus(), 5.2, "live", null, 4)).toEqual({
      text: "Page late",
      note: "4\u00a0s",
      level: "bad",
    });
    expect(linkWords(linkStatus({ quality: 0.4 }), 0.1).level).toBe("near");
    expect(linkWords(linkStatus({ adopted: null, state: "none" }), null).text).toBe("No vehicle");
    expect(linkWords(null, null).text).toBe("No vehicle");
  });

  it("warns of a low battery and a bad fix", () => {
    expect([0.8, 0.2, 0.1].map((battery_share) => batteryLevel(vehicleState({ battery_share })))).toEqual([
      "neutral",
      "near",
      "bad",
    ]);
    expect(batteryWord(vehicleState({ battery_share: null, battery_v: 15.2 }))).toBe("15.2\u00a0V");
    expect(
      (["rtk_fixed", "2d", "no_fix"] as const).map((gnss_fix) => fixLevel(vehicleState({ gnss_fix }))),
    ).toEqual(["neutral", "near", "bad"]);
    const unheard = vehicleState({ gnss_fix: "none", gnss_t_mono_s: null });
    expect([fixWord(unheard), fixLevel(unheard)]).toEqual(["–", "neutral"]);
  });
});
