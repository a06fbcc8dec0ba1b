import { beforeEach, describe, expect, it, vi } from "vitest";
import { now_ms } from "../src/store/clock";
import { lease, linkStatus, nodes, takeFlying } from "../src/store/flying";
import { acknowledgeLoss, isLossCalling, loss } from "../src/store/losses";
import { forgetClock, takeClock } from "../src/store/server_clock";
import { link } from "../src/store/state";
import { linkStatus as status, vehicleMessage, vehicleState } from "./flight_samples";

const linkNode = (state: string) => [{ name: "link", state, restarts: 0, text: "" }] as never;

beforeEach(() => {
  now_ms.value = 0;
  link.value = "open";
  lease.value = { ...lease.value, mine: true };
  nodes.value = [];
  linkStatus.value = null;
  takeFlying({ v: 1, type: "link", link: status() }, 0);
  takeFlying(vehicleMessage(), 0);
});

describe("a loss in flight", () => {
  it("is of the server, of the link, or of the vehicle", () => {
    expect(loss.value).toBeNull();
    now_ms.value = 10_000;
    expect(loss.value).toBe("slow");
    takeFlying({ v: 1, type: "link", link: status({ state: "lost", silent_s: 10 }) }, 10_000);
    expect(loss.value).toBe("vehicle");
    nodes.value = linkNode("silent");
    expect(loss.value).toBe("link");
    link.value = "silent";
    expect(loss.value).toBe("server");
  });

  it("is of a line over which the vehicle is shown where it was seconds ago", () => {
    takeClock({ v: 1, type: "clock", page_ms: 0, now_mono_s: 100.2 }, 10);
    takeFlying(vehicleMessage({ now_mono_s: 102.2 }), 6500);
    expect(loss.value).toBe("slow");
    expect(isLossCalling.value).toBe(true);
    acknowledgeLoss();
    expect(isLossCalling.value).toBe(false);
    link.value = "silent";
    expect(isLossCalling.value).toBe(true);
    forgetClock();
  });

  it("calls until it was seen, and anew when it is another or comes again", () => {
    nodes.value = linkNode("silent");
    expect(isLossCalling.value).toBe(true);
    acknowledgeLoss();
    expect(isLossCalling.value).toBe(false);
    link.value = "silent";
    expect(isLossCalling.value).toBe(true);
    acknowledgeLoss();
    nodes.value = linkNode("running");
    link.value = "open";
    expect(isLossCalling.value).toBe(false);
    link.value = "lost";
    expect(isLossCalling.value).toBe(true);
  });

  it("is none of a vehicle that was disarmed when it was last heard, nor where there is none", () => {
    link.value = "lost";
    takeFlying(vehicleMessage({ state: vehicleState({ armed: false }) }), 0);
    expect(loss.value).toBeNull();
    takeFlying(vehicleMessage(), 0);
    expect(loss.value).toBe("server");
    linkStatus.value = null;
    expect(loss.value).toBeNull();
  });
});

describe("the alarm", () => {
  it("sounds once the browser lets it, until it is acknowledged or muted", async () => {
    vi.useFakeTimers();
    const gestures: (() => void)[] = [];
    const heard_hz: number[] = [];
    let isAllowed = false;
    class FakeAudio {
      state = "suspended";
      currentTime = 0;
      destination = {};
      onstatechange: (() => void) | null = null;
      resume(): Promise<void> {
        if (isAllowed) this.state = "running";
        this.onstatechange?.();
        return isAllowed ? Promise.resolve() : new Promise(() => undefined);
      }
      createGain() {
        const gain = { setValueAtTime: () => undefined, linearRampToValueAtTime: () => undefined };
        return { gain, connect: () => undefined };
      }
      createOscillator() {
        const frequency = { value: 0 };
        const start = () => heard_hz.push(frequency.value);
        return { frequency, start, stop: () => undefined, connect: (next: unknown) => next };
      }
    }
    vi.stubGlobal("AudioContext", FakeAudio);
    vi.stubGlobal("document", {
      documentElement: { dataset: {} },
      addEventListener: (_: string, gesture: () => void) => gestures.push(gesture),
    });
    const { mayBeHeard, startSound, switchSound } = await import("../src/shell/sound");

    startSound();
    link.value = "silent";
    await vi.advanceTimersByTimeAsync(5000);
    expect([mayBeHeard.value, heard_hz.length]).toEqual([false, 0]);
    isAllowed = true;
    gestures[0]?.();
    await vi.advanceTimersByTimeAsync(0);
    const once = heard_hz.length;
    expect(once).toBeGreaterThan(1);
    // Falling, unlike the one for obstacles.
    expect(heard_hz).toEqual([...heard_hz].sort((a, b) => b - a));
    await vi.advanceTimersByTimeAsync(6000);
    expect(heard_hz.length).toBe(3 * once);

    acknowledgeLoss();
    await vi.advanceTimersByTimeAsync(60_000);
    expect(heard_hz.length).toBe(3 * once);

    link.value = "open";
    link.value = "lost";
    expect(heard_hz.length).toBe(4 * once);
    await switchSound(false);
    await vi.advanceTimersByTimeAsync(60_000);
    expect(heard_hz.length).toBe(4 * once);
    vi.useRealTimers();
    vi.unstubAllGlobals();
  });
});
