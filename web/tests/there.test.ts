import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import type { RecordingFetchDoc, RecordingsThereDoc, StationRecordingsDoc } from "../src/messages";
import { now_ms } from "../src/store/clock";
import { receive } from "../src/store/reduce";
import { errors } from "../src/store/state";
import {
  THERE,
  askThere,
  endFetch,
  fetchOf,
  fetchThere,
  fetchWords,
  forgetThere,
  listWords,
  takeThere,
  there,
  unlisted,
} from "../src/store/there";

const SHA = "ab".repeat(32);

const bravo: StationRecordingsDoc = {
  name: "Bravo",
  state: "live",
  listed: "listed",
  age_s: 20,
  text: "",
  recordings: [
    {
      sha256: SHA,
      name: "flight.mcap",
      bytes: 12_000_000,
      started_utc: "2026-01-01T10:00:00Z",
      duration_s: 300,
      vehicle: "Vehicle 1",
      plan_name: "Ridge",
      recording_id: null,
    },
  ],
};

const fetching: RecordingFetchDoc = {
  station: "Bravo",
  sha256: SHA,
  name: "flight.mcap",
  bytes: 12_000_000,
  have_bytes: 3_000_000,
  state: "fetching",
  left_s: 1125,
  text: "",
};

const doc = (more: Partial<RecordingsThereDoc> = {}): RecordingsThereDoc => ({
  now_mono_s: 500,
  is_offered: true,
  kb_s: 8,
  stations: [bravo],
  fetches: [],
  ...more,
});

const asked = vi.fn<(path: string, init?: RequestInit) => Promise<Response>>();

beforeEach(() => {
  forgetThere();
  asked.mockReset();
  vi.stubGlobal("fetch", asked);
});

afterEach(() => vi.unstubAllGlobals());

describe("recordings of other stations", () => {
  test("how a list stands: lost first, then how old it is by now", () => {
    now_ms.value = 10_000;
    takeThere(doc(), 10_000);
    expect(listWords(bravo)).toBe("20 s ago");
    expect(listWords({ ...bravo, age_s: 0 })).toBe("just now");
    now_ms.value = 40_000;
    expect(listWords(bravo)).toBe("50 s ago");
    expect(listWords({ ...bravo, age_s: 270 })).toBe("5 min ago");
    expect(listWords({ ...bravo, state: "lost" })).toBe("lost · 50 s ago");
    expect(listWords({ ...bravo, state: "lost", listed: "asking", age_s: null })).toBe("lost");
    expect(listWords({ ...bravo, listed: "no", age_s: null })).toBe("not asked yet");
    expect(listWords({ ...bravo, listed: "silent", age_s: null })).toBe("no answer");
  });

  test("a fetch tells what is there, of how much, and how long it takes", () => {
    expect(fetchWords(fetching)).toBe("3.0 of 12\u00a0MB · 18:45 left");
    expect(fetchWords({ ...fetching, left_s: null })).toBe("3.0 of 12\u00a0MB");
    expect(fetchWords({ ...fetching, state: "waiting" })).toContain("waits");
    expect(fetchWords({ ...fetching, state: "failed" })).toBe("failed at 3.0 of 12\u00a0MB");
    expect(fetchWords({ ...fetching, state: "failed", have_bytes: 0 })).toBe("failed");
  });

  test("what the stream tells stands beside its recording, or alone where no list has it", () => {
    receive({ v: 1, type: "station_recordings", stations: [bravo] });
    receive({ v: 1, type: "station_fetches", fetches: [fetching] });
    expect(fetchOf("Bravo", SHA)).toEqual(fetching);
    expect(fetchOf("Charlie", SHA)).toBeUndefined();
    expect(unlisted.value).toEqual([]);
    receive({ v: 1, type: "station_recordings", stations: [{ ...bravo, name: "Charlie" }] });
    expect(unlisted.value).toEqual([fetching]);
    receive({ v: 1, type: "station_recordings", stations: [] });
    expect(unlisted.value).toEqual([fetching]);
    receive({ v: 1, type: "station_fetches", fetches: [] });
    expect(unlisted.value).toEqual([]);
  });

  test("looking asks, pressing fetches, and cancelling deletes", async () => {
    asked.mockImplementation(async (_, init) =>
      init?.method === "GET" ? Response.json(doc()) : new Response(null, { status: 204 }),
    );
    await askThere();
    expect(there.value).toEqual([bravo]);
    await askThere({ pressed: true });
    await fetchThere("Bravo", SHA);
    await endFetch(fetching);
    expect(asked.mock.calls.map(([path, init]) => [init?.method, path])).toEqual([
      ["GET", "/api/stations/recordings?ask=true"],
      ["GET", "/api/stations/recordings?ask=true&fresh_s=3"],
      ["POST", `/api/stations/Bravo/recordings/${SHA}`],
      ["DELETE", `/api/stations/Bravo/recordings/${SHA}`],
    ]);
  });

  test("a refusal is said where they are listed", async () => {
    asked.mockImplementation(async () =>
      Response.json(
        { code: "observer", what: "Olga is an observer.", where: "", advice: "" },
        { status: 403 },
      ),
    );
    await fetchThere("Bravo", SHA);
    expect(errors.value[THERE]?.what).toBe("Olga is an observer.");
  });
});
