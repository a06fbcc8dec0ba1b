import { afterEach, expect, it, vi } from "vitest";
import type { JobDoc } from "../src/messages";

// The stores look at them while they are loaded.
const document = { documentElement: { dataset: {} } };
const location = { protocol: "http:", host: "test", hash: "", href: "http://test/" };
const window = { addEventListener: () => undefined };
const history = { replaceState: () => undefined };
for (const [name, value] of Object.entries({ document, location, history, window }))
  vi.stubGlobal(name, value);
await import("../src/store/arrivals");
const { NO_HINTS, sentFiles } = await import("../src/store/files");
const { jobs, notices } = await import("../src/store/state");
const { drawer } = await import("../src/store/view");

afterEach(() => {
  drawer.value = null;
  notices.value = [];
});

function fails(id: string): void {
  sentFiles.value = new Map([[id, { file: new File(["x"], "a.laz"), hints: NO_HINTS, replaces: false }]]);
  const error = { code: "raster_format", what: "It is cut short.", where: "a.laz", advice: "Copy it again." };
  const job: JobDoc = { id, label: "Reading a.laz", step: "", progress: null, state: "failed", error };
  jobs.value = new Map([[id, job]]);
  jobs.value = new Map(jobs.value);
}

it("tells once of a file that could not be read where the panel that says so is tucked away", () => {
  vi.stubGlobal("matchMedia", () => ({ matches: true }));
  fails("1");
  expect(notices.value.map(({ error }) => error.what)).toEqual(["It is cut short."]);
});

it("leaves it to the panel where that is seen", () => {
  vi.stubGlobal("matchMedia", () => ({ matches: false }));
  fails("2");
  vi.stubGlobal("matchMedia", () => ({ matches: true }));
  drawer.value = "left";
  fails("3");
  expect(notices.value).toEqual([]);
});
