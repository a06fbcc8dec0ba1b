import { describe, expect, it } from "vitest";
import { rememberResult, verdictOf } from "../src/store/results";
import { computation, result, state } from "./samples";

const ready = (revision: number, certified = true, feasible: boolean | null = true) =>
  state(revision, {
    computation: computation({ revision, state: "ready", result: result(certified, feasible) }),
  });
const running = (revision: number) => state(revision);

describe("the last known result", () => {
  it("stays while the next one is computed, with the time it was computed at", () => {
    const first = rememberResult(null, ready(1), 1000);
    const during = rememberResult(first, running(2), 2000);
    expect(during).toMatchObject({ revision: 1, at_ms: 1000 });
    expect(rememberResult(during, ready(2), 3000)).toMatchObject({ revision: 2, at_ms: 3000 });
  });

  it("keeps its time when the same one is told again", () => {
    const first = rememberResult(null, ready(1), 1000);
    expect(rememberResult(first, ready(1), 5000)?.at_ms).toBe(1000);
  });

  it("is forgotten when the plan is empty, in error, or another one", () => {
    const first = rememberResult(null, ready(1), 0);
    const empty = state(2, { computation: computation({ revision: 2, state: "empty" }) });
    const failed = state(2, { computation: computation({ revision: 2, state: "error" }) });
    expect(rememberResult(first, empty, 1)).toBeNull();
    expect(rememberResult(first, failed, 1)).toBeNull();
    expect(rememberResult(first, { ...running(1), plan_id: "p2" }, 1)).toBeNull();
  });
});

describe("the verdict", () => {
  it("is certified or not only for the document on the page", () => {
    expect(verdictOf(ready(1), true)).toBe("certified");
    expect(verdictOf(ready(1, false), true)).toBe("not_certified");
    expect(verdictOf(ready(1, true, false), true)).toBe("not_feasible");
    expect(verdictOf(ready(1, false, false), true)).toBe("not_certified");
    expect(verdictOf(ready(1, true, null), true)).toBe("certified");
    expect(verdictOf(ready(1), false)).toBe("computing");
    expect(verdictOf(running(1), false)).toBe("computing");
  });

  it("is none without a plan, and error when it cannot be computed", () => {
    expect(verdictOf(null, false)).toBe("none");
    expect(verdictOf(state(1, { computation: computation({ state: "error" }) }), true)).toBe("error");
  });
});
