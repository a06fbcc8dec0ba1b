import { describe, expect, it } from "vitest";
import { BANNER_MS, endingsOf, parted } from "../src/store/alerts";
import { alertDoc, alert } from "./obstacle_samples";

const doc = (id: string, over: boolean) => alertDoc(id, { alert: alert(id), over });
const ids = (docs: readonly { alert: { id: string } }[]) => docs.map((entry) => entry.alert.id);

describe("an alert that is over", () => {
  const all = [doc("a", true)];
  const endings = endingsOf(new Map(), all, 1000);

  it("keeps its banner for five seconds, then it is counted on a chip", () => {
    expect(ids(parted(all, endings, 1000 + BANNER_MS - 1).banner)).toEqual(["a"]);
    const later = parted(all, endingsOf(endings, all, 3000), 1000 + BANNER_MS);
    expect([ids(later.banner), ids(later.chip)]).toEqual([[], ["a"]]);
  });

  it("takes no banner from what is there", () => {
    const both = [doc("b", false), ...all];
    const shown = parted(both, endingsOf(endings, both, 1001), 1001);
    expect([ids(shown.banner), ids(shown.chip)]).toEqual([["b"], ["a"]]);
  });

  it("that begins again begins its five seconds again", () => {
    const again = endingsOf(endingsOf(endings, [doc("a", false)], 7000), all, 9000);
    expect(ids(parted(all, again, 9001).banner)).toEqual(["a"]);
  });
});
