import { beforeEach, describe, expect, it } from "vitest";
import type { UwbLiveDoc } from "../src/messages";
import { receive } from "../src/store/reduce";
import {
  NO_RADAR,
  dismissGroundError,
  forgetTraversability,
  groundError,
  hasTraversability,
  isGroundJob,
  tellGroundErrors,
  traversability,
} from "../src/store/traversability";
import { isRadarLog, ruleQuery } from "../src/store/files";
import {
  figures,
  leftOut,
  legendOf,
  liveWords,
  reasonsOf,
  shownLayer,
} from "../src/traversability/ground_words";
import { ground } from "./track_samples";

const plain = (text: string) => text.replace(/\u00a0/g, " ").replace(/\u202f/g, "");
const tell = (state: ReturnType<typeof ground>) =>
  receive({ v: 1, type: "traversability", traversability: state });

beforeEach(() => {
  forgetTraversability();
  tellGroundErrors();
});

describe("traversability", () => {
  it("is there once it has been worked out, and stays while a log is taken in", () => {
    expect(hasTraversability.value).toBe(false);
    tell(ground({ state: "working", text: "Clearing foliage" }));
    expect(hasTraversability.value).toBe(true);
    expect(traversability.value.text).toBe("Clearing foliage");
  });

  it("keeps an error until it is read, and tells the next one", () => {
    const error = { code: "radar_log", what: "Broken.", where: "", advice: "Record it anew." };
    tell(ground({ error }));
    expect(groundError.value).toEqual(error);
    dismissGroundError();
    expect(groundError.value).toBeNull();
    tell(ground({ error: { ...error, what: "Empty." } }));
    expect(groundError.value?.what).toBe("Empty.");
  });

  it("tells the same error again after another attempt", () => {
    const error = { code: "radar_log", what: "Broken.", where: "", advice: "" };
    tell(ground({ error }));
    dismissGroundError();
    tellGroundErrors();
    expect(groundError.value).toEqual(error);
  });

  it("has jobs and files of its own", () => {
    const labels = ["Traversability", "Traversability with wood.npz", "Reading etna.tif"];
    expect(labels.map((label) => isGroundJob({ label }))).toEqual([true, true, false]);
    expect(["wood.NPZ", "etna.tif"].map((name) => isRadarLog(new File([], name)))).toEqual([true, false]);
  });
});

describe("a radar that scans now", () => {
  const live = (fields: Partial<UwbLiveDoc>): UwbLiveDoc => ({ ...NO_RADAR, source: "rover", ...fields });

  it("says how it does, and its silence", () => {
    expect(plain(liveWords(live({ state: "live", scans: 1240, per_s: 9.8 })))).toBe(
      "rover: 1240 live scans, 9.8 a second.",
    );
    expect(plain(liveWords(live({ state: "silent", silent_s: 12, scans: 1240 })))).toBe(
      "rover: the UWB radar has sent nothing for 12 s.",
    );
  });

  it("says what was left out and why", () => {
    expect(leftOut(live({}))).toEqual([]);
    expect(leftOut(live({ unplaced: 3, other_geometry: 1, is_full: true })).map(plain)).toEqual([
      "3 left out: where the vehicle was is not known.",
      "1 left out: other range bins than at first.",
      "No more are taken: put the maps away to begin anew.",
    ]);
  });

  it("is fused by the rule that is set, and by nothing that is not", () => {
    expect(ruleQuery({ rule: "paper", p_o: 0.7, c_th: null })).toEqual([
      ["rule", "paper"],
      ["p_o", "0.7"],
    ]);
  });
});

describe("the figures of a map", () => {
  const values = (state: ReturnType<typeof ground>) => figures(state).map(({ value }) => plain(value));

  it("are shares of what is known; without a log nothing is cleared, and that is said", () => {
    expect(values(ground())).toEqual(["20000", "15.0 %", "–", "–"]);
    expect(figures(ground())[2]?.note).toBe("needs a radar log");
  });

  it("are told with a log, also where it cleared nothing", () => {
    expect(values(ground({ uwb_log: "a.npz", cleared: 0, seen: 500 }))).toEqual([
      "20000",
      "15.0 %",
      "0.0 %",
      "2.5 %",
    ]);
    expect(values(ground({ uwb_log: "a.npz", untraversable: 0 }))[2]).toBe("–");
  });
});

describe("the layer on show", () => {
  it("is the only one there is until a radar log has been taken in", () => {
    expect(shownLayer("probability", ground())).toBe("before");
    expect(shownLayer("probability", ground({ uwb_log: "a.npz" }))).toBe("probability");
  });

  it("has a legend of texts with their colours; what is no colour is left out", () => {
    expect(legendOf(ground())).toEqual([
      { text: "Hard", color: "#a696d6" },
      { text: "Untraversable", color: "#3a1c78" },
    ]);
    expect(legendOf(ground({ legend_colors: ["url(x)"] }))).toEqual([]);
  });
});

describe("a landing site", () => {
  it("does not say its distance twice", () => {
    expect(reasonsOf({ reasons: ["Slope 0.3 deg", "46 m from the point"] })).toEqual(["Slope 0.3°"]);
    expect(
      reasonsOf({ reasons: ["26.2 m from the nearest obstacle (1.4 m needed)", "Uneven by 0.1 cm"] }),
    ).toEqual(["26.2\u00a0m from the nearest obstacle (1.4\u00a0m needed)", "Uneven by 0.1\u00a0cm"]);
  });
});
