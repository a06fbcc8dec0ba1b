import { beforeEach, describe, expect, it } from "vitest";
import { EditQueue, type Edit } from "../src/store/edits";
import type { PlanDoc, PlanEdit } from "../src/messages";
import { computation, plan, result, state } from "./samples";

const rename = (name: string): Edit => ({
  label: "Rename",
  place: "plan",
  change: (doc) => ({ ...doc, name }),
  coalesce: false,
});

const radius = (radius_m: number): Edit => ({
  label: "Radius",
  place: "surface",
  change: (doc) => ({ ...doc, surface: { ...doc.surface, radius_m } }),
  coalesce: true,
});

let queue: EditQueue;

beforeEach(() => {
  queue = new EditQueue();
  queue.snapshot(state(1));
});

function sent(now_ms = 0): PlanEdit {
  const step = queue.next(now_ms);
  if (!step || !("send" in step)) throw new Error(`nothing to send: ${JSON.stringify(step)}`);
  return step.send;
}

const answer = (edit: PlanEdit, revision: number) => state(revision, { document: edit.document });

describe("editing", () => {
  it("shows an edit at once, before the server knows it", () => {
    queue.edit(rename("New"));
    expect(queue.document?.name).toBe("New");
    expect(queue.server?.document.name).toBe("Test");
    expect(queue.dirty).toBe(true);
  });

  it("ignores edits before the first state", () => {
    const early = new EditQueue();
    early.edit(rename("New"));
    expect(early.document).toBeNull();
    expect(early.next(0)).toBeNull();
  });

  it("sends one document at a time, the latest one", () => {
    queue.edit(rename("1"));
    const first = sent();
    queue.edit(rename("2"));
    queue.edit(rename("3"));
    expect(queue.next(0)).toBeNull();
    queue.accepted(answer(first, 2));
    const second = sent();
    expect(second.document.name).toBe("3");
    expect(second.base_revision).toBe(2);
    queue.accepted(answer(second, 3));
    expect(queue.dirty).toBe(false);
    expect(queue.next(0)).toBeNull();
  });

  it("sends sliders at most every 80 ms, other edits at once", () => {
    queue.edit(radius(21));
    const first = sent(1000);
    expect(first.coalesce).toBe(true);
    queue.accepted(answer(first, 2));
    queue.edit(radius(22));
    expect(queue.next(1020)).toEqual({ wait_ms: 60 });
    queue.edit(rename("now"));
    const second = sent(1021);
    expect(second.coalesce).toBe(false);
    expect(second.document.surface.radius_m).toBe(22);
  });

  it("goes back to the server's document when an edit is refused", () => {
    queue.edit(rename("bad"));
    sent();
    queue.refused();
    expect(queue.document?.name).toBe("Test");
    expect(queue.dirty).toBe(false);
  });

  it("keeps edits that never got an answer, in order", () => {
    queue.edit(rename("1"));
    sent();
    queue.edit(radius(9));
    queue.unanswered();
    const again = sent();
    expect(again.document.name).toBe("1");
    expect(again.document.surface.radius_m).toBe(9);
  });
});

describe("states of the server", () => {
  const other = (revision: number, fields: Partial<PlanDoc> = {}) =>
    state(revision, { document: plan({ pois: [], ...fields }) });

  it("replace the local document, with local edits made on top", () => {
    queue.edit(rename("mine"));
    queue.pushed(other(2, { name: "theirs" }));
    expect(queue.document).toMatchObject({ name: "mine", pois: [] });
  });

  it("older than the known one change nothing", () => {
    queue.pushed(state(5));
    queue.pushed(other(4));
    expect(queue.server?.revision).toBe(5);
    queue.takeAnswer(other(3));
    expect(queue.server?.revision).toBe(5);
  });

  it("with a finished computation are not undone by the slower answer to the edit", () => {
    queue.edit(rename("x"));
    const edit = sent();
    const ready = computation({ revision: 2, state: "ready", result: result(true) });
    queue.pushed({ ...answer(edit, 2), computation: ready });
    queue.accepted(answer(edit, 2));
    expect(queue.server?.computation.state).toBe("ready");
    expect(queue.dirty).toBe(false);
  });

  it("of another plan end all local edits", () => {
    queue.edit(rename("mine"));
    queue.pushed({ ...state(1), plan_id: "p2" });
    expect(queue.dirty).toBe(false);
    expect(queue.document?.name).toBe("Test");
  });

  it("after a reconnection keep unsent edits, even when the server counts anew", () => {
    queue.pushed(state(9));
    queue.edit(rename("mine"));
    queue.snapshot(state(2));
    expect(sent()).toMatchObject({ base_revision: 2, document: { name: "mine" } });
  });
});

describe("a stale edit", () => {
  it("is made again on the newer document", () => {
    queue.edit(rename("mine"));
    sent();
    const again = queue.stale(state(7, { document: plan({ pois: [] }) }));
    expect(again).toBe(true);
    expect(sent()).toMatchObject({ base_revision: 7, document: { name: "mine", pois: [] } });
  });

  it("is given up after a few attempts", () => {
    queue.edit(rename("mine"));
    const outcomes = [2, 3, 4, 5].map((revision) => {
      sent();
      return queue.stale(state(revision));
    });
    expect(outcomes).toEqual([true, true, true, false]);
    expect(queue.document?.name).toBe("Test");
  });

  it("is given up when another plan is open by now", () => {
    queue.edit(rename("mine"));
    sent();
    expect(queue.stale({ ...state(3), plan_id: "p2" })).toBe(false);
    expect(queue.dirty).toBe(false);
  });
});
