import { beforeEach, describe, expect, it } from "vitest";
import { receive } from "../src/store/reduce";
import { forgetMoving, hasTracks, isEndangered, moving, movingWatch } from "../src/store/moving";
import { now_ms } from "../src/store/clock";
import {
  closestWords,
  displayWords,
  headline,
  offNoseOf,
  trackSpeed,
  trackWords,
} from "../src/tracks/track_words";
import { cone, track, tracksMessage, tracksStatus } from "./track_samples";

const plain = (text: string) => text.replace(/\u00a0/g, " ");

beforeEach(() => {
  forgetMoving("live");
  forgetMoving("replay");
  now_ms.value = performance.now();
});

describe("moving objects", () => {
  it("are kept for each source, and forgotten when the server says so", () => {
    receive(tracksMessage(tracksStatus({ frames: 7 })));
    receive(tracksMessage(tracksStatus({ frames: 9 }), "replay"));
    expect([moving.live.value?.status.frames, moving.replay.value?.status.frames]).toEqual([7, 9]);
    receive(tracksMessage(null));
    expect([hasTracks.live.value, hasTracks.replay.value]).toEqual([false, true]);
  });

  it("are not relied on once their node is silent; a recording is never silent", () => {
    const known = { status: tracksStatus(), received_ms: 1000 };
    expect(movingWatch(known, true, 3000)).toBe("running");
    expect(movingWatch(known, true, 4000)).toBe("silent");
    expect(movingWatch(known, false, 4000)).toBe("running");
    expect(movingWatch({ ...known, status: tracksStatus({ state: "frozen" }) }, true, 1000)).toBe("frozen");
  });

  it("endanger while the one that comes too near is still watched", () => {
    receive(tracksMessage(tracksStatus({ tracks: [track({ dangerous: false })] })));
    expect(isEndangered.live.value).toBe(false);
    receive(tracksMessage(tracksStatus({ tracks: [track()] })));
    expect(isEndangered.live.value).toBe(true);
    now_ms.value += 10_000;
    expect(isEndangered.live.value).toBe(false);
  });
});

describe("a moving object in words", () => {
  it("says how near it will come and when, or that it will not", () => {
    expect(plain(closestWords(track()))).toBe("1.2 m in 4 s");
    expect(plain(closestWords(track({ closest_m: 31, closest_in_s: 72 })))).toBe("31 m later");
    expect(closestWords(track({ closest_in_s: 0 }))).toBe("not nearer");
  });

  it("says that something stands still rather than a speed of noise", () => {
    expect(plain(trackSpeed(track()))).toBe("2.6 m/s");
    expect(trackSpeed(track({ moving: false }))).toBe("still");
  });

  it("says where it is from the nose, and how long it has been followed", () => {
    expect([offNoseOf(24, 0), offNoseOf(10, 350), offNoseOf(350, 10)]).toEqual([24, 20, -20]);
    expect(plain(trackWords(track(), 24))).toBe(
      "#12: 19.7 m, 24° right, 2.6 m/s, closest 1.2 m in 4 s; followed for 12 s, 118 times seen",
    );
    expect(plain(trackWords(track({ closest_in_s: 0 }), null))).toContain(
      "19.7 m, 2.6 m/s, not getting nearer",
    );
  });
});

describe("the velocity display in words", () => {
  const proposal = {
    velocity_enu_m_s: [-2, 3] as [number, number],
    hold_s: 5,
    closest_m: 3.4,
    text: "Turn 34 deg left",
  };

  it("tells the present velocity, what comes too near and what is proposed", () => {
    const text = plain(displayWords(tracksStatus({ tracks: [track()], proposal }), "running", 350));
    expect(text).toBe(
      "Velocities: now 4.0 m/s, 10° right; #12 comes as near as 1.2 m in 4 s; proposed: Turn 34 deg left",
    );
  });

  it("says that nothing is watched, and why", () => {
    expect(displayWords(tracksStatus(), "stale", 0)).toContain("not watched, frames have stopped");
    expect(displayWords(tracksStatus({ velocity_enu_m_s: null }), "running", null)).toContain(
      "own velocity unknown",
    );
  });

  it("has one thing in large letters: not watched, no way out, nothing near, or nothing", () => {
    const busy = tracksStatus({ cones: [cone()] });
    expect(headline(busy, "silent")).toBe("NOT WATCHED");
    expect(headline({ ...busy, no_proposal: "Climb" }, "running")).toBe("NO SAFE VELOCITY");
    expect(headline(tracksStatus(), "running")).toBe("NO TRACK NEAR");
    expect(headline(busy, "running")).toBe("");
  });
});
