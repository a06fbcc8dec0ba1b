import { afterEach, describe, expect, it, vi } from "vitest";
import type { BagDoc } from "../src/messages";
import { bags, isBag, loadBags, putAway, startsAsBag } from "../src/store/bags";

const bytes = (text: string): Uint8Array<ArrayBuffer> => Uint8Array.from(text, (char) => char.charCodeAt(0));

/** The first record of an MCAP file. */
function mcap(profile: string, library: string): Uint8Array<ArrayBuffer> {
  const length = (text: string) => String.fromCharCode(text.length, 0, 0, 0);
  const body = length(profile) + profile + length(library) + library;
  return bytes(`\x89MCAP0\r\n\x01${String.fromCharCode(body.length, 0, 0, 0, 0, 0, 0, 0)}${body}`);
}

describe("a bag of ROS is told by how it begins", () => {
  it("knows those of ROS 1 and ROS 2, and archives", () => {
    for (const head of ["#ROSBAG V2.0\n", "SQLite format 3\0", "PK\x03\x04"])
      expect(startsAsBag(bytes(head))).toBe(true);
    expect(startsAsBag(mcap("ros2", "libmcap 0.8.0"))).toBe(true);
    expect(startsAsBag(mcap("", "rosbag2"))).toBe(true);
  });

  it("takes no recording of Hedgehop's for one, but what was written for ROS", () => {
    expect(startsAsBag(mcap("", "hedgehop 0.1.0"))).toBe(false);
    expect(startsAsBag(mcap("ros2", "hedgehop ros2"))).toBe(true);
  });

  it("is not misled by what is cut short", async () => {
    expect(startsAsBag(bytes("\x89MCAP0\r\n"))).toBe(true); // the server says what is wrong with it
    expect(startsAsBag(bytes(""))).toBe(false);
    expect(await isBag(new File([mcap("", "hedgehop 0.1.0")], "flight.mcap"))).toBe(false);
    expect(await isBag(new File(["x"], "flight.tlog"))).toBe(false);
    expect(await isBag(new File(["x"], "run.bag"))).toBe(true);
  });
});

describe("bags that the station keeps", () => {
  afterEach(() => {
    vi.unstubAllGlobals();
    bags.value = [];
  });

  it("are listed anew when a page is loaded, and stay listed until the station has put them away", async () => {
    const bag = { id: "a1", name: "run.bag", topics: [], missing: [] } as unknown as BagDoc;
    let kept = [bag];
    const asked: string[] = [];
    vi.stubGlobal("fetch", (path: string, { method }: RequestInit) => {
      asked.push(`${method} ${path}`);
      if (method === "DELETE" && asked.length > 3) kept = [];
      else if (method === "DELETE")
        return Promise.resolve(Response.json({ code: "in_use", what: "no" }, { status: 409 }));
      return Promise.resolve(Response.json(method === "GET" ? kept : {}));
    });
    await loadBags();
    expect(bags.value).toEqual([bag]);
    await putAway(bag); // a recording is being made of it
    expect(bags.value).toEqual([bag]);
    await putAway(bag);
    expect(bags.value).toEqual([]);
    expect(asked).toEqual([
      "GET /api/bags",
      "DELETE /api/bags/a1",
      "GET /api/bags",
      "DELETE /api/bags/a1",
      "GET /api/bags",
    ]);
  });
});
