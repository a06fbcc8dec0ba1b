import { beforeEach, describe, expect, it, vi } from "vitest";
import { nextStep } from "../src/fly/next_step";
import type { ChecklistDoc, ChecklistText } from "../src/messages";
import {
  CHECKLIST,
  checklistObstacle,
  checklistText,
  draftOf,
  isTicked,
  keepDraft,
  openPoints,
  readChecklist,
  showChecklist,
  startsHeading,
  tickPoint,
  writeChecklist,
  WRITING,
} from "../src/store/checklist";
import { fly } from "../src/store/flying";
import { pending } from "../src/store/outcomes";
import { errors } from "../src/store/state";
import { facts, flyState } from "./flight_samples";

const point = (text: string, heading = "", ticked_by = "") => ({
  text,
  heading,
  ticked_by,
  ticked_utc_s: ticked_by ? 1 : null,
});
const list = (fields: Partial<ChecklistDoc> = {}): ChecklistDoc => ({
  profile: "Quad",
  revision: "r",
  points: [point("Propellers", "Vehicle", "Anna"), point("Battery", "Vehicle"), point("No people", "Place")],
  why_again: "",
  fault: "",
  ...fields,
});
const kept: ChecklistText = {
  profile: "Quad",
  text: "one\n",
  revision: "r1",
  before: null,
  changed_by: "Anna",
  changed_utc: "",
  suggested: "",
};
const answering = (answer: () => Response) =>
  vi.spyOn(globalThis, "fetch").mockImplementation(async () => answer());
const json = (body: object, status = 200) => new Response(JSON.stringify(body), { status });

beforeEach(() => {
  vi.restoreAllMocks();
  checklistText.value = null;
  keepDraft("Quad", null);
  fly.value = flyState({
    onboard: { ...flyState().onboard, state: "verified", digest: "d", is_open_plan: true },
    preflight: { ok: true, rows: [] } as never,
    checklist: list(),
  });
});

describe("a checklist", () => {
  it("holds the start up while a point is open, and says how many", () => {
    expect(openPoints(list())).toBe(2);
    expect(checklistObstacle(list())).toContain("2 points");
    expect(checklistObstacle(list({ points: [point("Battery")] }))).toContain("the open point");
    expect(checklistObstacle(list({ points: [point("Battery", "", "Anna")] }))).toBeNull();
    expect(checklistObstacle(list({ points: [] }))).toBeNull();
    expect(checklistObstacle(null)).toBeNull();
    expect(checklistObstacle(list({ points: [], fault: "broken" }))).toContain("cannot be read");
  });

  it("is the next step's reason", () => {
    const now = facts({ flight: null, fly: fly.value });
    expect(nextStep(now)).toEqual({ id: "start", why: "Tick the checklist first: 2 points" });
    expect(
      nextStep({ ...now, fly: { ...flyState(), ...fly.value, checklist: list({ points: [] }) } }),
    ).toEqual({
      id: "start",
    });
  });

  it("names each heading once", () => {
    const { points } = list();
    expect(points.map((_, index) => startsHeading(points, index))).toEqual([true, false, true]);
    expect(startsHeading([point("a"), point("b")], 0)).toBe(false);
  });
});

describe("a tick", () => {
  it("is shown at once, names what it is for, and is taken back when it is refused", async () => {
    const fetched = answering(() => json({ code: "check_needed", what: "The list was changed." }, 409));
    const doc = list();
    const sent = tickPoint(doc, 2, true);
    expect(isTicked(doc, 2)).toBe(true);
    await sent;
    const [path, init] = fetched.mock.calls[0]!;
    expect([path, init?.method]).toEqual(["/api/flight/checklist", "PUT"]);
    expect(JSON.parse(String(init?.body))).toEqual({ digest: "d", revision: "r", number: 2, ticked: true });
    expect(isTicked(doc, 2)).toBe(false);
    expect(errors.value[CHECKLIST]?.what).toBe("The list was changed.");
  });

  it("stands until the list shows it, which the answer may overtake", async () => {
    answering(() => json({}));
    const doc = list();
    const sent = tickPoint(doc, 2, true);
    await vi.waitFor(() => expect(pending.value.has(CHECKLIST)).toBe(false));
    expect(isTicked(doc, 2)).toBe(true);
    const ticked = list({
      points: [doc.points[0]!, point("Battery", "Vehicle", "Anna"), doc.points[2]!],
    });
    fly.value = flyState({ ...fly.value!, checklist: ticked });
    await sent;
    expect(isTicked(ticked, 2)).toBe(true);
    // What somebody else takes back from then on is seen at once.
    expect(isTicked(doc, 2)).toBe(false);
  });

  it("is taken back when no list ever shows it", async () => {
    vi.useFakeTimers();
    answering(() => json({}));
    const doc = list();
    const sent = tickPoint(doc, 2, true);
    await vi.advanceTimersByTimeAsync(1900);
    expect(isTicked(doc, 2)).toBe(true);
    await vi.advanceTimersByTimeAsync(200);
    await sent;
    expect(isTicked(doc, 2)).toBe(false);
    vi.useRealTimers();
  });

  it("is not sent without a mission on board", async () => {
    const fetched = answering(() => json({}));
    fly.value = flyState({ checklist: list() });
    await tickPoint(list(), 2, true);
    expect(fetched).not.toHaveBeenCalled();
  });
});

describe("its text", () => {
  it("is read and written by the revision that was seen", async () => {
    const fetched = answering(() => json(kept));
    showChecklist("Quad");
    await readChecklist();
    expect(fetched.mock.calls[0]![0]).toBe("/api/checklist?profile=Quad");
    expect(checklistText.value).toEqual(kept);
    keepDraft("Quad", "two");
    expect(await writeChecklist("two")).toBe(true);
    const body = JSON.parse(String(fetched.mock.calls[1]![1]?.body)) as object;
    expect(body).toEqual({ profile: "Quad", text: "two", instead_of: "r1" });
    expect(draftOf("Quad")).toBeNull();
  });

  it("that was refused is not lost", async () => {
    checklistText.value = kept;
    keepDraft("Quad", "two");
    answering(() => json({ code: "conflict", what: "Ben has changed this checklist meanwhile." }, 409));
    expect(await writeChecklist("two")).toBe(false);
    expect(draftOf("Quad")).toBe("two");
    expect(checklistText.value).toEqual(kept);
    expect(errors.value[WRITING]?.what).toContain("Ben");
  });
});
