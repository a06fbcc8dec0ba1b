import { describe, expect, it } from "vitest";
import { cardsFor, sidestepWords } from "../src/obstacles/manoeuvres";
import { inOrder, isCalling, isShown, withAlert } from "../src/store/alerts";
import { alert, alertDoc, manoeuvre, obstacle, obstaclesState } from "./obstacle_samples";

describe("an alert", () => {
  it("is shown as soon as it is told, before the list that holds it", () => {
    const state = withAlert(obstaclesState(), alert("a"));
    expect(state.alerts).toHaveLength(1);
    expect(state.alerts[0]).toMatchObject({ over: false, acknowledged: false, began_utc_s: 1000 });
  });

  it("keeps its beginning and whether it was seen while it goes on", () => {
    const before = obstaclesState({ alerts: [alertDoc("a", { acknowledged: true })] });
    const next = withAlert(before, alert("a", { phase: "goes_on", t_utc_s: 1004 }));
    expect(next.alerts).toHaveLength(1);
    expect(next.alerts[0]).toMatchObject({ began_utc_s: 1000, acknowledged: true, over: false });
    expect(next.alerts[0]?.alert.t_utc_s).toBe(1004);
  });

  it("that is over says so and still tells where it was", () => {
    const before = obstaclesState({ alerts: [alertDoc("a")] });
    const [entry] = withAlert(before, alert("a", { phase: "ends", obstacle: null })).alerts;
    expect(entry?.over).toBe(true);
    expect(entry?.alert.obstacle?.distance_m).toBe(8.6);
  });

  it("that ends without having begun here is none", () => {
    expect(withAlert(obstaclesState(), alert("a", { phase: "ends" })).alerts).toEqual([]);
  });

  it("stays until it is over and acknowledged, and calls until either", () => {
    const stages = [
      [false, false],
      [false, true],
      [true, false],
      [true, true],
    ] as const;
    const docs = stages.map(([over, acknowledged]) => alertDoc("a", { over, acknowledged }));
    expect(docs.map(isShown)).toEqual([true, true, true, false]);
    expect(docs.map(isCalling)).toEqual([true, false, false, false]);
  });
});

describe("several alerts", () => {
  const soon = alertDoc("soon", {
    alert: alert("soon", { obstacle: obstacle({ time_to_contact_s: 2 }) }),
    began_utc_s: 1009,
  });
  const later = alertDoc("later", {
    alert: alert("later", { obstacle: obstacle({ time_to_contact_s: 5 }) }),
  });
  const ids = (docs: readonly { alert: { id: string } }[]) => docs.map((doc) => doc.alert.id);

  it("stand with the most urgent on top", () => {
    const seen = alertDoc("seen", { acknowledged: true });
    const over = alertDoc("over", { over: true });
    const trouble = alertDoc("trouble", { alert: alert("trouble", { kind: "sensor", obstacle: null }) });
    const conflict = alertDoc("conflict", { alert: alert("conflict", { kind: "conflict" }) });
    expect(ids(inOrder([over, seen, trouble, conflict, later, soon]))).toEqual([
      "soon",
      "later",
      "conflict",
      "trouble",
      "seen",
      "over",
    ]);
  });

  it("do not change places for a tenth of a second", () => {
    const at = (id: string, time_to_contact_s: number, began_utc_s: number) =>
      alertDoc(id, { alert: alert(id, { obstacle: obstacle({ time_to_contact_s }) }), began_utc_s });
    expect(ids(inOrder([at("b", 5.0, 1001), at("a", 5.1, 1000)]))).toEqual(["a", "b"]);
    expect(ids(inOrder([at("b", 5.1, 1001), at("a", 5.0, 1000)]))).toEqual(["a", "b"]);
  });
});

describe("the ways past an obstacle", () => {
  const there = [alertDoc("a")];

  it("have their places from the beginning", () => {
    expect(cardsFor(there, { manoeuvres: [], busy: "Looking for a way around" })).toEqual([
      { kind: "over", doc: null },
      { kind: "around", doc: null },
    ]);
    const over = manoeuvre("m", "over");
    expect(cardsFor(there, { manoeuvres: [over], busy: "" })).toEqual([
      { kind: "over", doc: over },
      { kind: "around", doc: null },
    ]);
  });

  it("are those of the alert that stands on top and has any", () => {
    const cards = cardsFor([alertDoc("b"), alertDoc("a")], {
      manoeuvres: [manoeuvre("m", "around")],
      busy: "",
    });
    expect(cards?.[1]?.doc?.id).toBe("m");
  });

  it("are offered for a conflict on the mission ahead too, not for a sensor's trouble", () => {
    const of = (kind: "conflict" | "sensor") =>
      cardsFor([alertDoc("a", { alert: alert("a", { kind }) })], {
        manoeuvres: [manoeuvre("m", "over")],
        busy: "",
      });
    expect(of("conflict")?.[0]?.doc?.id).toBe("m");
    expect(of("sensor")).toBeNull();
  });

  it("are gone with the obstacle", () => {
    const manoeuvres = [manoeuvre("m", "over")];
    expect(cardsFor([alertDoc("a", { over: true })], { manoeuvres, busy: "" })).toBeNull();
    expect(cardsFor([], { manoeuvres, busy: "Looking" })).toBeNull();
    expect(cardsFor(there, { manoeuvres: [], busy: "" })).toBeNull();
  });
});

describe("an approach", () => {
  const approach = alertDoc("moving", { alert: alert("moving", { kind: "approach", obstacle: null }) });
  const sidestep = manoeuvre("s", "sidestep", { for_alert: "moving" });

  it("is as urgent as an obstacle seconds away, and stands before one that is not", () => {
    const at = (id: string, time_to_contact_s: number | null) =>
      alertDoc(id, { alert: alert(id, { obstacle: obstacle({ time_to_contact_s }) }) });
    const order = inOrder([at("still", null), approach, at("now", 2)]);
    expect(order.map((entry) => entry.alert.id)).toEqual(["now", "moving", "still"]);
  });

  it("has one way out of it, whose place is there while it is being looked for", () => {
    const busy = "Looking for a sidestep";
    expect(cardsFor([approach], { manoeuvres: [], busy })).toEqual([{ kind: "sidestep", doc: null }]);
    expect(cardsFor([approach], { manoeuvres: [sidestep], busy: "" })).toEqual([
      { kind: "sidestep", doc: sidestep },
    ]);
  });

  it("says first what is flown, then what comes of it", () => {
    expect(
      sidestepWords("Turn 3 deg right, 4.9 m/s for 6 s, passes 3.7 m away, then back to the mission."),
    ).toEqual({
      does: "Turn 3 deg right, 4.9 m/s",
      detail: "for 6 s, passes 3.7 m away",
    });
    expect(sidestepWords("Stop here").does).toBe("Stop here");
  });

  it("and an obstacle do not hide each other's ways, whichever calls first", () => {
    const over = manoeuvre("m", "over");
    const known = { manoeuvres: [over, sidestep], busy: "" };
    const kinds = (docs: readonly ReturnType<typeof alertDoc>[]) =>
      cardsFor(docs, known)?.map(({ kind }) => kind);
    expect(kinds([approach, alertDoc("a")])).toEqual(["sidestep", "over", "around"]);
    expect(kinds([alertDoc("a"), approach])).toEqual(["sidestep", "over", "around"]);
    expect(kinds([alertDoc("a"), { ...approach, over: true }])).toEqual(["over", "around"]);
  });
});
