import { beforeEach, describe, expect, it, vi } from "vitest";
import type { ParametersDoc, VehicleDoc } from "../src/messages";
import { request } from "../src/net/api";
import {
  acknowledgeElsewhere,
  active,
  calling,
  fleet,
  isCallingLoss,
  takeActive,
  takeFleet,
} from "../src/store/fleet";
import { fly, linkStatus, takeFlying, texts } from "../src/store/flying";
import { order, outcomes, pending } from "../src/store/outcomes";
import { isReading, lookAtParameters, parameters, readParameters } from "../src/store/parameters";
import { shortcutOf } from "../src/shell/shortcuts";
import { flyState, linkStatus as link } from "./flight_samples";

const vehicle = (number: number, more: Partial<VehicleDoc> = {}): VehicleDoc => ({
  number,
  name: `Vehicle ${number}`,
  lat_deg: null,
  lon_deg: null,
  alt_rel_home_m: null,
  ground_speed_m_s: null,
  mode: "AUTO",
  phase: "flying",
  armed: true,
  link: "live",
  silent_s: 0,
  battery_share: 0.8,
  holder: null,
  plan_name: "",
  alarm: null,
  ...more,
});

const lost = { kind: "loss", key: "lost", text: "Nothing is heard of it any more." } as const;
const tell = (...vehicles: VehicleDoc[]) => takeFleet({ v: 1, type: "fleet", vehicles });
const show = (number: number) => takeActive({ v: 1, type: "active", vehicle: number });

beforeEach(() => {
  show(1);
  tell(vehicle(1), vehicle(2));
});

describe("several vehicles", () => {
  it("nothing of the one before is left when another one is shown", () => {
    linkStatus.value = { status: link(), received_ms: 0 };
    fly.value = flyState();
    show(2);
    expect([linkStatus.value, fly.value, active.value]).toEqual([null, null, 2]);
  });

  it("what was read of one vehicle's words stays read", () => {
    const said = { t_utc_s: 5, severity: 2, text: "Crash" };
    takeFlying({ v: 1, type: "text", source: "live", text: said }, 0);
    const before = texts.value;
    show(2);
    expect(texts.value).toEqual([]);
    show(1);
    expect(texts.value).toBe(before);
  });

  it("every request names the vehicle that is shown", async () => {
    const asked = vi.fn().mockResolvedValue(new Response("{}"));
    vi.stubGlobal("fetch", asked);
    show(2);
    await request("POST", "/api/flight/land");
    expect(asked.mock.calls[0]?.[1].headers["Hedgehop-Vehicle"]).toBe("2");
    vi.unstubAllGlobals();
  });

  it("parameters that were asked of the one before are not taken for those of this one", async () => {
    const read = (count: number) => ({ rows: count }) as unknown as ParametersDoc;
    let answer: (response: Response) => void = () => undefined;
    vi.stubGlobal("fetch", () => new Promise<Response>((resolve) => (answer = resolve)));
    parameters.value = read(1);
    const asked = lookAtParameters();
    show(2);
    expect(parameters.value).toBeNull();
    answer(new Response(JSON.stringify(read(2))));
    await asked;
    expect(parameters.value).toBeNull();
    vi.unstubAllGlobals();
  });

  it("one list that is waited for keeps nobody from reading another vehicle's", async () => {
    let answer: (response: Response) => void = () => undefined;
    vi.stubGlobal("fetch", () => new Promise<Response>((resolve) => (answer = resolve)));
    const asked = readParameters();
    expect(isReading.value).toBe(true);
    show(2);
    expect(isReading.value).toBe(false);
    show(1);
    expect(isReading.value).toBe(true);
    answer(new Response("{}"));
    await asked;
    expect(isReading.value).toBe(false);
    vi.unstubAllGlobals();
  });

  it("an order to the one before says nothing beside the other one", async () => {
    let answer: (response: Response) => void = () => undefined;
    vi.stubGlobal("fetch", () => new Promise<Response>((resolve) => (answer = resolve)));
    const asked = order({ place: "safety", path: "/api/flight/return", done: "The vehicle returns home." });
    expect(pending.value.has("safety")).toBe(true);
    show(2);
    expect(pending.value.has("safety")).toBe(false);
    answer(new Response("{}"));
    await asked;
    expect(outcomes.value["safety"]).toBeUndefined();
    vi.unstubAllGlobals();
  });

  it("an alarm of another one calls until it is seen, and again when it comes again", () => {
    tell(vehicle(1, { alarm: lost }), vehicle(2, { alarm: lost }));
    // Its own is on the page already.
    expect(calling.value.map(({ number }) => number)).toEqual([2]);
    expect(isCallingLoss.value).toBe(true);
    acknowledgeElsewhere();
    tell(vehicle(1), vehicle(2, { alarm: lost }));
    expect(calling.value).toEqual([]);
    tell(vehicle(1), vehicle(2));
    tell(vehicle(1), vehicle(2, { alarm: lost }));
    expect(calling.value).toHaveLength(1);
    expect(fleet.value).toHaveLength(2);
  });

  it("two that come near each other are an alarm of the one that is shown, too", () => {
    const near = { kind: "near", key: "near 1 2", text: "They may come within 3 m." } as const;
    tell(vehicle(1, { alarm: near }), vehicle(2, { alarm: near }));
    expect(calling.value.map(({ number }) => number)).toEqual([1, 2]);
    expect(isCallingLoss.value).toBe(false);
    acknowledgeElsewhere();
    expect(calling.value).toEqual([]);
  });

  it("a loss is read before what is near, and each is seen by itself", () => {
    const alert = { kind: "alert", key: "a", text: "Ahead: 12 m." } as const;
    tell(vehicle(1), vehicle(2, { alarm: alert }), vehicle(3, { alarm: lost }), vehicle(4, { alarm: lost }));
    const first = () => calling.value[0]?.number;
    const read = [first()];
    while (calling.value.length > 0) {
      acknowledgeElsewhere();
      read.push(first());
    }
    expect(read).toEqual([3, 4, 2, undefined]);
  });

  it("G and a digit show a vehicle; a digit alone is a section still", () => {
    const press = { key: "2", mod: false, shift: false };
    expect(shortcutOf(press, false, { view: "fly", afterG: true })).toEqual({ id: "vehicle", vehicle: 2 });
    expect(shortcutOf(press, false, { view: "fly", afterG: false })?.id).toBe("section");
    expect(shortcutOf(press, true, { view: "fly", afterG: true })).toBeNull();
  });
});
