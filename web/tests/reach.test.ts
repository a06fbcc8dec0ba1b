import { beforeEach, describe, expect, it } from "vitest";
import { now_ms } from "../src/store/clock";
import { forgetFlying, heard, lease, linkState, linkStatus, nodes, takeFlying } from "../src/store/flying";
import { loss } from "../src/store/losses";
import { failed, isOld, late_s, unheard_s, whyNotAsk, whyNotCommand, whyUnheard } from "../src/store/reach";
import { forgetClock, takeClock } from "../src/store/server_clock";
import { link } from "../src/store/state";
import { linkStatus as status, vehicleMessage } from "./flight_samples";

const linkNode = (state: string) => [{ name: "link", state, restarts: 0, text: "" }] as never;

beforeEach(() => {
  forgetFlying(1, 1);
  now_ms.value = 0;
  link.value = "open";
  lease.value = { ...lease.value, holder: "Anna", mine: true };
  nodes.value = linkNode("running");
  heard.live.value = heard.replay.value = linkStatus.value = null;
  takeFlying({ v: 1, type: "link", link: status() }, 0);
  takeFlying(vehicleMessage(), 0);
  takeFlying(vehicleMessage({ source: "replay" }), 0);
});

describe("how far this page's word reaches", () => {
  it("is to the vehicle, for whoever is in charge", () => {
    expect([failed.value, whyUnheard.value, whyNotAsk.value, whyNotCommand.value]).toEqual([
      null,
      null,
      null,
      null,
    ]);
    lease.value = { ...lease.value, mine: false };
    expect(whyNotCommand.value).toContain("You look on");
    expect(whyNotAsk.value).toContain("You look on");
    expect(whyUnheard.value).toBeNull();
  });

  it.each(["silent", "restarting"])(
    "ends at a link that is %s, though the server still does as asked",
    (state) => {
      nodes.value = linkNode(state);
      expect(failed.value).toBe("link");
      expect(whyNotCommand.value).toContain("transmitter");
      expect(whyNotAsk.value).toBeNull();
    },
  );

  it("ends at a link that runs again until it has said how things are by now", () => {
    takeFlying({ v: 1, type: "nodes", nodes: linkNode("silent") }, 100);
    takeFlying({ v: 1, type: "nodes", nodes: linkNode("running") }, 200);
    expect(failed.value).toBe("link");
    expect(isOld("live", "position")).toBe(true);
    takeFlying({ v: 1, type: "link", link: status() }, 300);
    expect(failed.value).toBeNull();
  });

  it("ends at a link that is down though no vehicle is adopted: nothing connects, and no transmitter is named", () => {
    takeFlying({ v: 1, type: "link", link: status({ adopted: null }) }, 0);
    takeFlying({ v: 1, type: "nodes", nodes: linkNode("restarting") }, 100);
    expect(failed.value).toBeNull();
    expect(whyNotCommand.value).toContain("started again");
    expect(whyNotCommand.value).not.toContain("transmitter");
    expect(whyNotAsk.value).toBeNull();
  });

  it.each(["silent", "lost", "connecting"] as const)("ends at a server to which the page is %s", (state) => {
    link.value = state;
    nodes.value = linkNode("silent");
    expect(failed.value).toBe("server");
    expect(whyNotCommand.value).toContain("transmitter");
    expect(whyNotAsk.value).toContain("server");
  });

  it("makes every live value old at once when it ends, and no recording's", () => {
    expect([isOld("live", "position"), isOld("replay", "position")]).toEqual([false, false]);
    nodes.value = linkNode("silent");
    expect([isOld("live", "position"), isOld("replay", "position")]).toEqual([true, false]);
    nodes.value = linkNode("running");
    expect(isOld("live", "battery")).toBe(false);
  });

  it("counts from when the last word was said, not from when it came, once there is no more", () => {
    takeClock({ v: 1, type: "clock", page_ms: 0, now_mono_s: 100.2 }, 10);
    takeFlying(vehicleMessage({ now_mono_s: 102.2 }), 10_000);
    takeFlying({ v: 1, type: "link", link: status({ silent_s: 0.5 }) }, 10_000);
    now_ms.value = 13_000;
    link.value = "lost";
    expect(unheard_s.value).toBeCloseTo(0.5 + 3 + 8, 1);
    forgetClock();
    now_ms.value = 14_000;
    expect(unheard_s.value, "nothing tells how late it came").toBeCloseTo(4.5, 5);
  });

  it("says how late a slow line brings what the server says", () => {
    takeClock({ v: 1, type: "clock", page_ms: 0, now_mono_s: 100.2 }, 10);
    takeFlying(vehicleMessage({ now_mono_s: 101.2 }), 1050);
    expect(late_s.value).toBeNull();
    takeFlying(vehicleMessage({ now_mono_s: 102.2 }), 6500);
    expect(late_s.value).toBe(4);
    now_ms.value = 15_500;
    linkStatus.value = { ...linkStatus.value!, received_ms: 15_400 };
    expect(late_s.value, "what stands here is that old by now").toBe(12);
    link.value = "silent";
    expect(late_s.value).toBeNull();
    forgetClock();
  });

  it("is late as well while a slow line brings nothing of the vehicle, and leaves the link alone", () => {
    expect(late_s.value).toBeNull();
    now_ms.value = 4500;
    expect([late_s.value, linkState.value, loss.value]).toEqual([3, "live", "slow"]);
    nodes.value = linkNode("silent");
    expect([late_s.value, loss.value]).toEqual([null, "link"]);
    nodes.value = linkNode("running");
    linkStatus.value = null;
    expect(late_s.value).toBeNull();
  });
});
