import { beforeEach, describe, expect, it, vi } from "vitest";
import type { FlyState, VehicleState } from "../src/messages";
import { linkStatus, vehicleMessage, vehicleState } from "./flight_samples";

vi.stubGlobal("location", { protocol: "http:", host: "test", hash: "" });
const { acknowledgeBreach, breach, crossed, isBreachCalling } = await import("../src/store/breach");
const { fly, heard, linkStatus: link } = await import("../src/store/flying");
link.value = { status: linkStatus(), received_ms: 0 };

const told = (fields: Partial<VehicleState>) => {
  const state = vehicleState({ fence_ok: null, fence_breach: null, ...fields });
  heard.live.value = { message: vehicleMessage({ state }), received_ms: 0 };
};

beforeEach(() => {
  fly.value = null;
  told({});
});

describe("a fence that is crossed", () => {
  it("is told by either of both messages, and by none of them while it is kept", () => {
    expect(crossed({ fence_ok: false, fence_breach: null })).toBe("fence");
    expect(crossed({ fence_ok: true, fence_breach: "ceiling" })).toBe("ceiling");
    expect(crossed({ fence_ok: true, fence_breach: "none" })).toBeNull();
    expect(crossed({ fence_ok: null, fence_breach: null })).toBeNull();
    expect(crossed(null)).toBeNull();
  });

  it("says what the vehicle does, or that nobody read it", () => {
    told({ fence_breach: "boundary" });
    expect(breach.value?.where).toBe("What it does there was not read.");
    fly.value = { at_fence: "At its fence the vehicle returns." } as FlyState;
    expect([breach.value?.what, breach.value?.where]).toEqual([
      "The vehicle says that it is beyond the boundary of its fence.",
      "At its fence the vehicle returns.",
    ]);
  });

  it("calls until it was seen, and again for another part and another time", () => {
    told({ fence_breach: "boundary" });
    acknowledgeBreach();
    expect(isBreachCalling.value).toBe(false);
    expect(breach.value).not.toBeNull();
    told({ fence_breach: "ceiling" });
    expect(isBreachCalling.value).toBe(true);
    acknowledgeBreach();
    told({ fence_breach: "none" });
    told({ fence_breach: "ceiling" });
    expect(isBreachCalling.value).toBe(true);
  });
});
