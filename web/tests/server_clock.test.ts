import { describe, expect, it } from "vitest";
import { age_s } from "../src/store/ages";
import { serverNow_s, takeClock } from "../src/store/server_clock";
import { vehicleMessage, vehicleState } from "./flight_samples";

/** An answer to a ping sent at `page_ms` that was `there_ms` on its way there and `back_ms` back. */
function answer(page_ms: number, there_ms: number, back_ms: number, ahead_s: number): number {
  const clock = { v: 1, type: "clock", page_ms, now_mono_s: (page_ms + there_ms) / 1000 + ahead_s } as const;
  takeClock(clock, page_ms + there_ms + back_ms);
  return page_ms + there_ms + back_ms;
}

describe("the server's clock", () => {
  it("is known by the quickest answer, at its latest: half its way there and back later than its middle", () => {
    answer(1000, 10, 10, 500);
    expect(serverNow_s(2000)).toBeCloseTo(502.01, 3);
    answer(2000, 20, 9000, 500);
    expect(serverNow_s(12_000)).toBeCloseTo(512.01, 3);
  });

  it("is taken anew where both cannot be right: the page slept, or the server is another", () => {
    answer(20_000, 10, 10, 500);
    answer(21_000, 200, 200, 560);
    expect(serverNow_s(22_000)).toBeCloseTo(582.2, 1);
  });

  it("is measured anew after a minute", () => {
    answer(30_000, 1, 1, 560);
    answer(100_000, 50, 60, 560.02);
    expect(Math.abs((serverNow_s(101_000) ?? 0) - 661.02 - 0.05)).toBeLessThan(0.06);
  });

  it("makes what waited on a slow line as old as it is", () => {
    answer(200_000, 5, 5, 1000);
    const state = vehicleState({ position_t_mono_s: 1200 });
    const message = vehicleMessage({ now_mono_s: 1200.05, state });
    // It was made at 1200.05 and came sixteen seconds later.
    const heard = { message, received_ms: 216_000 };
    expect(age_s(heard, "position", 216_000)).toBeCloseTo(16, 1);
    expect(age_s(heard, "position", 217_000)).toBeCloseTo(17, 1);
  });
});
