import { describe, expect, it } from "vitest";
import { plannedWords } from "../src/obstacles/obstacle_orders";

describe("what a plan against what was seen says", () => {
  it("names what it lacks", () => {
    expect(plannedWords("home", "")).toBe("The way home is planned past what was seen.");
    expect(plannedWords("ahead", "Parts of the radar map are missing.")).toBe(
      "Planned from where the vehicle was, past what was seen. Not all: Parts of the radar map are missing.",
    );
  });
});
