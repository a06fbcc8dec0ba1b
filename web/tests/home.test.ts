import { beforeEach, describe, expect, it } from "vitest";
import type { ReturnDoc } from "../src/messages";
import { forgetHome, home } from "../src/store/home";
import { forgetClock, takeClock } from "../src/store/server_clock";
import { returnAge_s, returnTitle } from "../src/vehicle/return_words";

const CLEAR: ReturnDoc = {
  state: "certified",
  reasons: [],
  clearance_m: 4.2,
  instead: false,
  notes: [],
  judged_mono_s: 100,
};
const BLOCKED: ReturnDoc = {
  ...CLEAR,
  state: "not_certified",
  reasons: [{ code: "return_height", text: "It needs 30 m.", mend: "" }],
};

const told = (ret: ReturnDoc | null, is_judging_return = false) =>
  (home.value = { asked: null, is_judging: false, ret, is_judging_return });

describe("what Return says of itself", () => {
  beforeEach(() => (forgetHome(), forgetClock()));

  it("says nothing while home is where it was", () => expect(returnTitle(1000)).toBeNull());

  it("says that it is being judged, and then what is in the way", () => {
    told(null, true);
    expect(returnTitle(1000)).toContain("being judged");
    told(CLEAR);
    expect(returnTitle(1000)).toBe("Return certified");
    takeClock({ v: 1, type: "clock", page_ms: 1000, now_mono_s: 130 }, 1000);
    expect(returnTitle(1000)).toBe("Return certified, 0:30 ago");
    told(BLOCKED, true);
    expect(returnTitle(1000)).toBe("RETURN NOT CLEAR, being judged anew: It needs 30 m.");
  });

  it("is never called clear where it could not be judged", () => {
    told({ ...BLOCKED, state: "unknown", reasons: [] });
    expect(returnTitle(1000)).toBe("RETURN NOT JUDGED");
  });
});

describe("its age", () => {
  beforeEach(forgetClock);

  it("is not known before the server's clock is", () => expect(returnAge_s(CLEAR, 1000)).toBeNull());

  it("counts by the server's clock", () => {
    takeClock({ v: 1, type: "clock", page_ms: 1000, now_mono_s: 130 }, 1000);
    expect(returnAge_s(CLEAR, 1000)).toBeCloseTo(30, 3);
    expect(returnAge_s({ ...CLEAR, notes: [], judged_mono_s: 140 }, 1000)).toBe(0);
  });
});
