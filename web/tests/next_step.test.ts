import { describe, expect, it } from "vitest";
import { nextStep, wordsBeside } from "../src/fly/next_step";
import { uploadObstacle } from "../src/vehicle/orders";
import type {
  CheckRow,
  FlightStatus,
  OnboardDoc,
  PreflightDoc,
  TakenUpDoc,
  TransferStatus,
} from "../src/messages";
import { facts, flyState, linkStatus, vehicleState } from "./flight_samples";

const onboard = (fields: Partial<OnboardDoc> = {}): OnboardDoc =>
  ({ ...flyState().onboard, state: "verified", digest: "d", is_open_plan: true, ...fields }) as OnboardDoc;
const row = (state: CheckRow["state"], code: CheckRow["code"] = "gnss"): CheckRow => ({
  code,
  state,
  text: "",
  mend: "",
});
const checked = (...rows: CheckRow[]) =>
  flyState({ onboard: onboard(), preflight: { ok: true, rows } as PreflightDoc });
const phase = (name: FlightStatus["phase"]) => ({ phase: name }) as FlightStatus;

describe("a plan that was taken up beside other vehicles", () => {
  const taken = (state: CheckRow["state"]) =>
    facts({
      flight: phase("paused"),
      inAir: true,
      fly: flyState({
        taken_up: { others: { ...row(state, "others"), text: "It meets Bee." } } as TakenUpDoc,
      }),
    });

  it("is resumed where it meets none, or what is said is accepted", () => {
    expect(nextStep(taken("good"))).toEqual({ id: "resume" });
    expect(nextStep({ ...taken("accept"), othersAccepted: true })).toEqual({ id: "resume" });
    expect(nextStep(taken("accept"))).toMatchObject({ why: "Tick what you accept under On board first" });
  });

  it("waits, with the words, where it would meet one or nobody knows", () => {
    for (const state of ["bad", "unknown"] as const) {
      const step = nextStep({ ...taken(state), othersAccepted: true });
      expect(step).toEqual({ id: "resume", why: "It meets Bee." });
    }
  });
});

describe("the next step", () => {
  it("without a vehicle is the simulator, what was heard, or waiting", () => {
    expect(nextStep(facts({ link: null })).id).toBe("simulator");
    expect(nextStep(facts({ link: linkStatus({ adopted: null }) })).id).toBe("simulator");
    const candidates = [{ id: "a" }] as never;
    expect(nextStep(facts({ link: linkStatus({ adopted: null, candidates }) })).id).toBe("adopt");
    const connections = [{ state: "waiting" }] as never;
    expect(nextStep(facts({ link: linkStatus({ adopted: null, connections }) })).id).toBe("wait");
  });

  it("is to say, in flight too, whether who is heard from elsewhere is the silent vehicle", () => {
    const link = linkStatus({ again: { id: "b" } as never });
    expect(nextStep(facts({ link })).id).toBe("again");
    expect(nextStep(facts({ link, flight: phase("flying"), inAir: true })).id).toBe("again");
    expect(nextStep(facts({ link, mine: false })).id).toBe("take_control");
  });

  it("of an observer is to take control", () => {
    expect(nextStep(facts({ mine: false })).id).toBe("take_control");
    expect(nextStep(facts({ mine: false, flight: phase("flying"), inAir: true })).id).toBe("take_control");
  });

  it("goes from upload over check to start", () => {
    expect(nextStep(facts())).toEqual({ id: "upload" });
    expect(nextStep(facts({ obstacle: "Computing" }))).toEqual({ id: "upload", why: "Computing" });
    expect(nextStep(facts({ fly: flyState({ onboard: onboard() }) }))).toEqual({ id: "check" });
    expect(nextStep(facts({ fly: checked(row("good")) }))).toEqual({ id: "start" });
  });

  it("waits while anything is being done", () => {
    const transfer = { phase: "sending", done: 1, total: 9 } as TransferStatus;
    expect(nextStep(facts({ transfer })).id).toBe("wait");
    expect(nextStep(facts({ fly: flyState({ busy: "Checking the start" }) }))).toEqual({
      id: "wait",
      why: "Checking the start",
    });
  });

  it("is to upload again when the plan has changed since", () => {
    const fly = { ...checked(row("good")), onboard: onboard({ is_open_plan: false, plan_name: "Old" }) };
    expect(nextStep(facts({ fly })).id).toBe("upload");
    expect(nextStep(facts({ fly, obstacle: "No plan" })).id).toBe("start");
  });

  it("is to upload again once a plan that was taken up in the air has landed: it is no mission for a start", () => {
    const taken = onboard({ taken_up: true });
    expect(nextStep(facts({ fly: { ...checked(row("good")), onboard: taken } })).id).toBe("upload");
    const flight = { phase: "paused" } as FlightStatus;
    expect(nextStep(facts({ flight, inAir: true, fly: flyState({ onboard: taken }) })).id).toBe("resume");
  });

  it("is no start while anything is bad or unknown", () => {
    for (const state of ["bad", "unknown"] as const) {
      expect(nextStep(facts({ fly: checked(row("good"), row(state, "ready")) })).id).toBe("check");
    }
  });

  it("is a start once what must be accepted is ticked", () => {
    const fly = checked(row("accept", "gnss"), row("accept", "battery"));
    expect(nextStep(facts({ fly, accepted: new Set(["gnss"]) }))).toMatchObject({
      id: "start",
      why: "Tick what you accept first: Battery",
    });
    expect(nextStep(facts({ fly, accepted: new Set(["gnss", "battery"]) }))).toEqual({ id: "start" });
  });

  it("is never a start when something is to be accepted that nobody may accept", () => {
    expect(nextStep(facts({ fly: checked(row("accept", "clearance")) }))).toMatchObject({
      why: expect.stringContaining("Tick"),
    });
  });

  it("is another check when the last one is old", () => {
    expect(nextStep(facts({ fly: checked(row("good")), check_age_s: 200 })).id).toBe("check");
  });

  it("is no Resume where the link would refuse it, and says why in the link's own words", () => {
    const flight = { ...phase("paused"), not_resumed: "Home lies elsewhere now. Return home, or land." };
    const step = nextStep(facts({ flight, inAir: true }));
    expect(step).toEqual({ id: "resume", why: flight.not_resumed });
    const known = { unheard: null, hint: "", holder: null, isServerHeard: true };
    expect(wordsBeside(step, known)).toEqual([flight.not_resumed]);
    expect(nextStep(facts({ flight: { ...flight, not_resumed: "" }, inAir: true }))).toEqual({
      id: "resume",
    });
  });

  it("in flight is pause, resume or waiting", () => {
    const fly = checked(row("good"));
    const inAir = true;
    expect(nextStep(facts({ fly, inAir, flight: phase("flying") })).id).toBe("pause");
    expect(nextStep(facts({ fly, inAir, flight: phase("paused") })).id).toBe("resume");
    const isFlown = { ...phase("paused"), is_flown: true };
    expect(nextStep(facts({ fly, inAir, flight: isFlown })).id).toBe("wait");
    expect(nextStep(facts({ fly, inAir, flight: phase("returning") })).id).toBe("wait");
    expect(nextStep(facts({ fly, inAir, vehicle: vehicleState({ mode: "LOITER" }) }))).toMatchObject({
      id: "wait",
      why: expect.stringContaining("LOITER"),
    });
  });
});

describe("an upload", () => {
  it("needs a certified plan", () => {
    expect(uploadObstacle("certified")).toBeNull();
    for (const verdict of ["none", "error", "not_certified", "computing"] as const) {
      expect(uploadObstacle(verdict)).toBeTruthy();
    }
  });
});

describe("the words beside the next step", () => {
  const known = { unheard: null, hint: "2 places left", holder: "Anna is in charge.", isServerHeard: true };
  const cut = "The server is silent: use the pilot's transmitter";

  it("are the flight's hint, why the step waits, and to an observer who is in charge", () => {
    expect(wordsBeside({ id: "pause" }, known)).toEqual(["2 places left"]);
    expect(wordsBeside({ id: "check", why: "Check again" }, { ...known, hint: "" })).toEqual(["Check again"]);
    expect(wordsBeside({ id: "take_control" }, known)).toEqual(["2 places left", "Anna is in charge."]);
  });

  it("are for an observer, too, only why nothing is heard when the server is gone", () => {
    const gone = { ...known, unheard: cut, isServerHeard: false };
    expect(wordsBeside({ id: "take_control" }, gone)).toEqual([cut]);
    expect(wordsBeside({ id: "pause" }, gone)).toEqual([cut]);
  });

  it("still say who is in charge when only the link has failed", () => {
    expect(wordsBeside({ id: "take_control" }, { ...known, unheard: cut })).toEqual([
      cut,
      "Anna is in charge.",
    ]);
  });
});
