import { describe, expect, it } from "vitest";
import { isBag, startsAsBag } from "../src/store/bags";

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
