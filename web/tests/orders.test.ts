import { beforeEach, describe, expect, it, vi } from "vitest";
import { pending } from "../src/store/outcomes";
import { accept, accepted, EMERGENCY, land, stopMotors } from "../src/vehicle/orders";
import { fly } from "../src/store/flying";
import type { CheckRow, PreflightDoc } from "../src/messages";
import { flyState } from "./flight_samples";

const checkedAt = (checked_utc: string, rows: Partial<CheckRow>[] = []) =>
  flyState({ preflight: { checked_utc, rows } as unknown as PreflightDoc });

describe("what the operator accepts", () => {
  beforeEach(() => {
    fly.value = checkedAt("2026-01-01T00:00:00Z");
  });

  it("is ticked one by one, and unticked", () => {
    accept("gnss", true);
    accept("battery", true);
    accept("gnss", false);
    expect([...accepted.value]).toEqual(["battery"]);
  });

  it("holds for the check that was read, not for the next one", () => {
    accept("gnss", true);
    fly.value = checkedAt("2026-01-01T00:05:00Z");
    expect(accepted.value.size).toBe(0);
    accept("battery", true);
    expect([...accepted.value]).toEqual(["battery"]);
  });

  it("of other vehicles holds for what they did when it was ticked", () => {
    const others = (text: string) => checkedAt("2026-01-01T00:00:00Z", [{ code: "others", text }]);
    fly.value = others("Bee has such a mission on board.");
    accept("gnss", true);
    accept("others", true);
    expect([...accepted.value]).toEqual(["gnss", "others"]);
    fly.value = others("Bee is in the air.");
    expect([...accepted.value]).toEqual(["gnss"]);
    accept("others", true);
    expect([...accepted.value]).toEqual(["gnss", "others"]);
  });
});

describe("an emergency stop", () => {
  it("is held up by no order that is not answered", () => {
    vi.stubGlobal("fetch", () => new Promise<Response>(() => undefined));
    void land();
    expect(pending.value.size).toBe(1);
    expect(pending.value.has(EMERGENCY)).toBe(false);
    void stopMotors();
    expect(pending.value.has(EMERGENCY)).toBe(true);
    expect(pending.value.size).toBe(2);
    vi.unstubAllGlobals();
  });
});
