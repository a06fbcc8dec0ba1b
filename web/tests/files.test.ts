import { describe, expect, it } from "vitest";
import { recordingsAmong } from "../src/store/files";

const named = (name: string, bytes: number[] = [1, 2, 3]) => new File([new Uint8Array(bytes)], name);

describe("files that are flights", () => {
  it("are told by their ending", async () => {
    const flights = [named("a.mcap"), named("b.TLOG"), named("c.ulg")];
    const others = [named("d.tif"), named("e.npz"), named("f.csv")];
    expect(await recordingsAmong([...flights, ...others])).toEqual(new Set(flights));
  });

  it("are told by their first bytes where radar samples have the same ending", async () => {
    const log = named("00000001.BIN", [0xa3, 0x95, 0x80, 0]);
    expect(await recordingsAmong([log, named("adc.bin"), named("empty.bin", [])])).toEqual(new Set([log]));
  });
});
