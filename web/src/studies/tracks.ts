import { batch, computed, effect, signal } from "@preact/signals";
import type { JobDoc, PoleDoc, RadarFileDoc, RadarTracksBody, RadarTracksDoc } from "../messages";
import { asErrorDoc, isCancelled, requestJson } from "../net/api";
import { cancelJob, sendFile } from "../store/files";
import { order } from "../store/outcomes";
import { NOT_ASKED, askedTracks, chosen, chosenId, looksAt, shownTracks } from "../store/studies";
import { jobs, setError } from "../store/state";

/** Tracks against truth: the ODA data set's radar.csv with its optitrack.csv. */

/** Where errors of it appear. */
export const TRACKS = "radar_tracks";

const path = (id: string) => `/api/radar/files/${encodeURIComponent(id)}`;

/** Only rows of samples come with a capture. */
export const mayHaveCapture = (file: RadarFileDoc) => /\.csv$/i.test(file.name);

const SNIFFED_BYTES = 4096;
const [LEAST_COLUMNS, MOST_COLUMNS] = [8, 64];

/** Whether a text begins as rows of a motion capture do: a row of the radar's samples has thousands of values. */
export function looksLikeCapture(head: string): boolean {
  const rows = head.split(/\r?\n/).filter((line) => line.trim() !== "");
  const [first, second] = rows;
  if (first === undefined || second === undefined) return false;
  return [first, second].every((row) => {
    const columns = row.trim().replace(/,$/, "").split(",").length;
    return columns >= LEAST_COLUMNS && columns <= MOST_COLUMNS;
  });
}

export async function isCapture(file: File): Promise<boolean> {
  return /\.csv$/i.test(file.name) && looksLikeCapture(await file.slice(0, SNIFFED_BYTES).text());
}

/** The job that this page waits for, and whose file it is about. */
const awaited = signal<{ job: string; file: string } | null>(null);

export const followingJob = computed<JobDoc | null>(() => {
  const wanted = awaited.value;
  const job = wanted && wanted.file === chosenId.value ? jobs.value.get(wanted.job) : undefined;
  return job?.state === "running" ? job : null;
});

/** Another file is looked at. */
export function forgetTracks(): void {
  batch(() => {
    looksAt.value = "frames";
    askedTracks.value = NOT_ASKED;
    shownTracks.value = null;
  });
  setError(TRACKS, null);
}

/** Why the poles cannot be followed yet; null: they can. */
export function whyNot(file: RadarFileDoc, asked: RadarTracksBody): string | null {
  if (!file.capture_name) return "Give the optitrack.csv that was recorded beside it";
  if (asked.poles.length === 0) return "Add the poles with their places in the capture";
  return null;
}

export function change(fields: Partial<RadarTracksBody>): void {
  askedTracks.value = { ...askedTracks.value, ...fields };
}

export function setPole(index: number, fields: Partial<PoleDoc>): void {
  const poles = askedTracks.value.poles.map((pole, at) => (at === index ? { ...pole, ...fields } : pole));
  change({ poles });
}

/** Gives the chosen file the capture of the same flight; null takes it away. */
export async function setCapture(file: File | null): Promise<void> {
  const id = chosenId.value;
  if (id === null) return;
  setError(TRACKS, null);
  try {
    const address = `${path(id)}/capture`;
    if (file === null) await order({ place: TRACKS, path: address, method: "DELETE" });
    else await sendFile(`${address}?${new URLSearchParams({ filename: file.name })}`, file, "PUT");
    batch(() => {
      shownTracks.value = null;
      looksAt.value = "frames";
    });
  } catch (error) {
    if (!isCancelled(error)) setError(TRACKS, asErrorDoc(error));
  }
}

/** Starts it; what comes out is shown once it is there. */
export async function follow(): Promise<void> {
  const id = chosenId.value;
  if (id === null) return;
  const answer = await order({ place: TRACKS, path: `${path(id)}/tracks`, body: askedTracks.value });
  if (answer) awaited.value = { job: ((await answer.json()) as JobDoc).id, file: id };
}

export const cancelFollowing = () => followingJob.value && cancelJob(followingJob.value.id);

/** What was kept of an earlier one, with the places that were given then. */
async function show(id: string): Promise<void> {
  try {
    const found = await requestJson<RadarTracksDoc>("GET", `${path(id)}/tracks`);
    if (chosenId.value !== id) return;
    batch(() => {
      shownTracks.value = found;
      askedTracks.value = found.asked;
    });
  } catch (error) {
    setError(TRACKS, asErrorDoc(error));
  }
}

effect(() => {
  const wanted = awaited.value;
  const job = wanted && jobs.value.get(wanted.job);
  if (!wanted || !job || job.state === "running") return;
  awaited.value = null;
  if (job.error) setError(TRACKS, job.error);
  if (job.state !== "done") return;
  shownTracks.value = null;
  looksAt.value = "tracks";
  void show(wanted.file);
});

/** Whoever opens a file that was followed before, here or elsewhere, sees what came out; with another capture it is
 * nothing any more. */
effect(() => {
  const file = chosen.value;
  if (!file || awaited.peek() !== null) return;
  if (file.has_tracks && shownTracks.peek() === null) void show(file.id);
  if (!file.has_tracks && shownTracks.peek() !== null) {
    shownTracks.value = null;
    looksAt.value = "frames";
  }
});
