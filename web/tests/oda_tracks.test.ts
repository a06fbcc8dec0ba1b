import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import type { JobDoc, RadarFileDoc, RadarTracksDoc } from "../src/messages";
import { jobs } from "../src/store/state";
import { askedTracks, chosenId, looksAt, radarFiles, shownTracks } from "../src/store/studies";
import {
  change,
  follow,
  followingJob,
  isCapture,
  looksLikeCapture,
  mayHaveCapture,
  setPole,
  whyNot,
} from "../src/studies/tracks";
import { errors } from "../src/store/state";

const row = (columns: number) => Array.from({ length: columns }, (_, index) => index).join(",");
const HEAD = "time [ns],x,y,z,a [rad],b [rad],c [rad],d [rad]";

function file(fields: Partial<RadarFileDoc> = {}): RadarFileDoc {
  return {
    id: "f1",
    name: "radar.csv",
    bytes: 1,
    added_utc: "2026-01-01T00:00:00Z",
    cfg_name: "",
    capture_name: "optitrack.csv",
    has_tracks: false,
    ...fields,
  };
}

describe("a motion capture", () => {
  it.each([
    ["with a heading", `${HEAD}\n${row(8)}\n${row(8)}`, true],
    ["without one", `${row(8)},\r\n${row(8)},\r\n`, true],
    ["the radar's samples", `${row(4097)}\n${row(4097)}`, false],
    ["the radar's samples, cut off in the first row", row(900), false],
    ["points of a plan", "name,lat,lon\nA,1,2", false],
    ["nothing", "", false],
  ])("%s", (_, head, expected) => expect(looksLikeCapture(head)).toBe(expected));

  it("is told by its content, and only of rows", async () => {
    const text = `${HEAD}\n${row(8)}\n`;
    expect(await isCapture(new File([text], "anything.CSV"))).toBe(true);
    expect(await isCapture(new File([text], "anything.npy"))).toBe(false);
    expect([mayHaveCapture(file()), mayHaveCapture(file({ name: "cube.npy" }))]).toEqual([true, false]);
  });
});

describe("following the poles", () => {
  const found: RadarTracksDoc = {
    asked: { poles: [{ x_m: 1, z_m: -5 }], offset_s: 0.5, forward: "z" },
    capture_name: "optitrack.csv",
    part: {
      title: "radar.csv",
      duration_s: 0,
      contact: false,
      min_true_distance_m: null,
      alerts: 0,
      figures: [],
      notes: [],
      charts: [],
    },
  };
  const answers: Record<string, unknown> = {};

  beforeEach(() => {
    radarFiles.value = [file()];
    chosenId.value = "f1";
    vi.stubGlobal(
      "fetch",
      vi.fn(async (address: string, options?: RequestInit) =>
        Response.json(answers[`${options?.method ?? "GET"} ${address}`] ?? {}),
      ),
    );
  });
  afterEach(() => {
    vi.unstubAllGlobals();
    jobs.value = new Map();
    chosenId.value = null;
    shownTracks.value = null;
    looksAt.value = "frames";
    askedTracks.value = { poles: [], offset_s: 0, forward: "x" };
  });

  const job = (fields: Partial<JobDoc>): void => {
    const of: JobDoc = {
      id: "j1",
      label: "",
      step: "",
      progress: null,
      state: "running",
      error: null,
      ...fields,
    };
    jobs.value = new Map([["j1", of]]);
  };

  it("says what is missing", () => {
    expect(whyNot(file({ capture_name: "" }), askedTracks.value)).toContain("optitrack.csv");
    expect(whyNot(file(), askedTracks.value)).toContain("poles");
    change({
      poles: [
        { x_m: 0, z_m: 0 },
        { x_m: 1, z_m: 1 },
      ],
    });
    setPole(1, { z_m: -3 });
    expect(askedTracks.value.poles).toEqual([
      { x_m: 0, z_m: 0 },
      { x_m: 1, z_m: -3 },
    ]);
    expect(whyNot(file(), askedTracks.value)).toBeNull();
  });

  it("is watched, and shown with what it was asked for", async () => {
    answers["POST /api/radar/files/f1/tracks"] = { id: "j1" };
    answers["GET /api/radar/files/f1/tracks"] = found;
    await follow();
    job({ step: "Frame 10 of 100", progress: 0.1 });
    expect(followingJob.value?.progress).toBe(0.1);
    job({ state: "done" });
    expect(followingJob.value).toBeNull();
    await vi.waitFor(() => expect(shownTracks.value).toEqual(found));
    expect(looksAt.value).toBe("tracks");
    expect(askedTracks.value).toEqual(found.asked);
    // Another capture, given on any page: what was held against the one before is nothing any more.
    radarFiles.value = [file({ capture_name: "other.csv" })];
    expect([shownTracks.value, looksAt.value]).toEqual([null, "frames"]);
  });

  it("that failed says why and shows nothing", async () => {
    answers["POST /api/radar/files/f1/tracks"] = { id: "j1" };
    await follow();
    const error = { code: "radar_data", what: "Pole 2 is never nearer.", where: "pole 2", advice: "" };
    job({ state: "failed", error });
    expect(errors.value["radar_tracks"]).toEqual(error);
    expect(looksAt.value).toBe("frames");
  });
});
