import { describe, expect, it } from "vitest";
import { acknowledge, isLatched, severityLevel, withText, type TextEntry } from "../src/store/texts";

const said = (text: string, t_utc_s: number, severity = 6) => ({ text, t_utc_s, severity });
const take = (...messages: ReturnType<typeof said>[]) =>
  messages.reduce<readonly TextEntry[]>((entries, message) => withText(entries, message), []);

describe("the vehicle's messages", () => {
  it("stand newest first", () => {
    expect(take(said("a", 1), said("b", 2), said("c", 3)).map((entry) => entry.text)).toEqual([
      "c",
      "b",
      "a",
    ]);
  });

  it("that come late find their place", () => {
    expect(take(said("a", 1), said("c", 3), said("b", 2)).map((entry) => entry.text)).toEqual([
      "c",
      "b",
      "a",
    ]);
  });

  it("that repeat count up and move to the top", () => {
    const entries = take(said("PreArm", 1), said("b", 2), said("PreArm", 31), said("PreArm", 61));
    expect(entries.map(({ text, count }) => [text, count])).toEqual([
      ["PreArm", 3],
      ["b", 1],
    ]);
  });

  it("that are told again after a reconnection are not counted again", () => {
    const entries = take(said("a", 1), said("b", 2));
    expect(withText(entries, said("a", 1))).toBe(entries);
  });

  it("of old are new ones when they come back much later", () => {
    expect(take(said("a", 1), said("a", 500))).toHaveLength(2);
  });

  it("are as many as anybody reads", () => {
    const many = Array.from({ length: 400 }, (_, index) => said(`text ${index}`, index));
    expect(take(...many)).toHaveLength(200);
  });
});

describe("a critical message", () => {
  it("is latched until it is acknowledged, and stays so while it repeats", () => {
    const entries = take(said("Crash", 1, 1));
    const [entry] = entries;
    expect(entry && isLatched(entry)).toBe(true);
    const seen = acknowledge(entries, entry?.id ?? 0);
    const again = withText(seen, said("Crash", 20, 1));
    expect(again.map(({ count, acknowledged }) => [count, acknowledged])).toEqual([[2, true]]);
    expect(again.some(isLatched)).toBe(false);
  });

  it("that comes back after a while is latched anew", () => {
    const entries = take(said("Crash", 1, 1));
    const seen = acknowledge(entries, entries[0]?.id ?? 0);
    expect(withText(seen, said("Crash", 900, 1)).some(isLatched)).toBe(true);
  });

  it("is one of the three worst severities; errors only look bad", () => {
    expect(take(said("a", 1, 2)).some(isLatched)).toBe(true);
    expect(take(said("a", 1, 3)).some(isLatched)).toBe(false);
    expect([2, 3, 4, 6].map(severityLevel)).toEqual(["bad", "bad", "near", "neutral"]);
  });
});
