import { afterEach, describe, expect, it, vi } from "vitest";
import { matching } from "../src/ui/media";

afterEach(() => vi.unstubAllGlobals());

describe("what a media query says of the window", () => {
  it("is followed when the window changes", () => {
    const told: ((event: { matches: boolean }) => void)[] = [];
    const asked: string[] = [];
    vi.stubGlobal("matchMedia", (query: string) => {
      asked.push(query);
      return { matches: false, addEventListener: (_: string, tell: (typeof told)[0]) => told.push(tell) };
    });
    const isWide = matching("(min-width: 1100px)");
    expect(asked).toEqual(["(min-width: 1100px)"]);
    expect(isWide.value).toBe(false);
    told.forEach((tell) => tell({ matches: true }));
    expect(isWide.value).toBe(true);
  });

  it("is no where there is no window", () => {
    expect(matching("(min-width: 1100px)").value).toBe(false);
  });
});
