import { describe, expect, it } from "vitest";
import { recordingsAmong } from "../src/store/files";

const named = (name: string, bytes: number[] = [1, 2, 3]) => new File([new Uint8Array(bytes)], name);

describe("files that are flights", () => {
  it("are told by their ending", async () => {
    const flights = [named("a.mcap"), named("b.TLOG"), named("c.ulg")];
    const others = [named("d.tif"), named("e.npz"), named("f.csv")];
    expect(await recordingsAmong([...flights, ...others])).toEqual(new Set(flights));
  });

  it("are told by what a ZIP lists: a bag, or tiles of a surface model", async () => {
    const zip = (name: string, ...listed: string[]) =>
      new File([`PK\x03\x04${listed.join("PK\x01\x02")}`], name);
    const bags = [zip("a.zip", "flight/metadata.yaml", "flight/flight_0.db3"), zip("b.ZIP", "run_0.mcap")];
    const others = [zip("c.zip", "tiles/a.tif", "tiles/b.tif"), zip("d.zip")];
    expect(await recordingsAmong([...bags, ...others])).toEqual(new Set(bags));
  });

  it("are told by their first bytes where radar samples have the same ending", async () => {
    const log = named("00000001.BIN", [0xa3, 0x95, 0x80, 0]);
    expect(await recordingsAmong([log, named("adc.bin"), named("empty.bin", [])])).toEqual(new Set([log]));
  });
});
