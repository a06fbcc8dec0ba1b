import { describe, expect, it } from "vitest";
import { CONFIRM_MS, HOLD_MS, Hold } from "../src/ui/hold";

describe("a hold", () => {
  it("acts once, when the second is over", () => {
    const hold = new Hold();
    hold.press(1000);
    expect(hold.completes(1000 + HOLD_MS - 1)).toBe(false);
    expect(hold.completes(1000 + HOLD_MS)).toBe(true);
    expect(hold.completes(1000 + 2 * HOLD_MS)).toBe(false);
    expect(hold.release()).toBe("nothing");
  });

  it("fills its ring steadily", () => {
    const hold = new Hold();
    expect(hold.share(0)).toBe(0);
    hold.press(0);
    expect(hold.share(HOLD_MS / 4)).toBeCloseTo(0.25);
    expect(hold.share(10 * HOLD_MS)).toBe(1);
  });

  it("that is let go early does nothing, and says so", () => {
    const hold = new Hold();
    hold.press(0);
    expect(hold.release()).toBe("early");
    expect(hold.completes(5 * HOLD_MS)).toBe(false);
    expect(hold.share(5 * HOLD_MS)).toBe(0);
  });

  it("starts anew after it was let go: two halves are no whole", () => {
    const hold = new Hold();
    hold.press(0);
    hold.release();
    hold.press(600);
    expect(hold.completes(HOLD_MS + 100)).toBe(false);
    expect(hold.completes(600 + HOLD_MS)).toBe(true);
  });

  it("is not prolonged by keys that repeat", () => {
    const hold = new Hold();
    hold.press(0);
    hold.press(900);
    expect(hold.completes(HOLD_MS)).toBe(true);
  });
});

describe("assistive technology, which cannot hold", () => {
  it("presses twice", () => {
    const hold = new Hold();
    expect(hold.virtualClick(0)).toBe(false);
    expect(hold.virtualClick(1000)).toBe(true);
    expect(hold.virtualClick(1100)).toBe(false);
  });

  it("has not confirmed when the second press comes much later", () => {
    const hold = new Hold();
    hold.virtualClick(0);
    expect(hold.virtualClick(CONFIRM_MS + 1)).toBe(false);
  });
});
