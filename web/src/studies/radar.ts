import { batch, computed, signal } from "@preact/signals";
import type { RadarFileDoc, RadarFrame, RadarOpened, RadarReading } from "../messages";
import { asErrorDoc, isCancelled, requestJson } from "../net/api";
import { sendFile } from "../store/files";
import { order } from "../store/outcomes";
import { chosenId, marked, opened, radarFiles, reading, shownFrame, wantedFrame } from "../store/studies";
import { errors, pageId, setError } from "../store/state";
import { study } from "../store/view";
import { Newest } from "./newest";
import { forgetTracks, isCapture, setCapture } from "./tracks";

/** Where errors of this study appear: with the files, with how they are read, with the frame. */
export const FILES = "radar_files";
export const READING = "radar_reading";
export const FRAME = "radar_frame";

export const ENDINGS = ".npy,.bin,.csv";
export const isRadarSamples = (file: File) => /\.(npy|bin)$/i.test(file.name);

const path = (id: string) => `/api/radar/files/${encodeURIComponent(id)}`;

/** A frame that takes longer is given up when another is wanted. */
const PATIENCE_MS = 500;
const frames = new Newest(PATIENCE_MS);
/** Since when an answer is awaited, for saying so. */
const busySince_ms = signal<number | null>(null);
export const isBusy = computed(() => busySince_ms.value !== null);

function query(): string {
  const { sensor, samples, most } = reading.value;
  const asked = new URLSearchParams({ page: pageId.value ?? "page" });
  if (sensor) asked.set("sensor", sensor);
  if (samples) asked.set("samples", samples);
  if (most) asked.set("most", String(most));
  return asked.toString();
}

interface Question {
  address: string;
  place: string;
  signal: AbortSignal;
}

async function answered<T>({ address, place, signal }: Question, take: (answer: T) => void): Promise<void> {
  busySince_ms.value = performance.now();
  try {
    const answer = await requestJson<T>("GET", address, undefined, { signal });
    if (signal.aborted) return;
    setError(place, null);
    take(answer);
  } catch (error) {
    if (!isCancelled(error)) setError(place, asErrorDoc(error));
  } finally {
    busySince_ms.value = null;
  }
}

/** Which files there are, asked with every new connection; the stream tells what changes. */
export async function learnFiles(): Promise<void> {
  try {
    radarFiles.value = await requestJson<RadarFileDoc[]>("GET", "/api/radar/files");
  } catch (error) {
    setError(FILES, asErrorDoc(error));
  }
}

/** Opens the chosen file as it is to be read, and shows a frame of it. */
function open(): void {
  const id = chosenId.value;
  frames.forget();
  batch(() => {
    opened.value = null;
    shownFrame.value = null;
    marked.value = null;
  });
  [READING, FRAME].forEach((place) => setError(place, null));
  if (id === null) return;
  frames.ask((signal) =>
    answered<RadarOpened>({ address: `${path(id)}/open?${query()}`, place: READING, signal }, (answer) => {
      opened.value = answer;
      goToFrame(wantedFrame.value);
    }),
  );
}

export function choose(id: string): void {
  if (id === chosenId.value) return;
  batch(() => {
    chosenId.value = id;
    reading.value = {};
    wantedFrame.value = 0;
  });
  forgetTracks();
  open();
}

export function readAs(change: Partial<RadarReading>): void {
  reading.value = { ...reading.value, ...change };
  open();
}

export function goToFrame(number: number): void {
  const [id, count] = [chosenId.value, opened.value?.frames ?? 0];
  if (id === null || count === 0) return;
  const kept = Math.min(count - 1, Math.max(0, number));
  wantedFrame.value = kept;
  frames.ask((signal) =>
    answered<RadarFrame>(
      { address: `${path(id)}/frames/${kept}?${query()}`, place: FRAME, signal },
      (answer) => {
        batch(() => {
          shownFrame.value = answer;
          marked.value = null;
        });
      },
    ),
  );
}

export const stepFrame = (by: number) => goToFrame(wantedFrame.value + by);

/** Brings files in, and opens the last of them; a capture among them goes with what is open then. */
export async function bringIn(files: readonly File[]): Promise<void> {
  if (files.length === 0) return;
  study.value = "radar";
  setError(FILES, null);
  const captured = await Promise.all(files.map(isCapture));
  await keep(files.filter((_, index) => !captured[index]));
  for (const capture of files.filter((_, index) => captured[index])) {
    if (chosenId.value === null) return refuseCapture(capture);
    await setCapture(capture);
  }
}

/** Unless something worse has been said already. */
function refuseCapture({ name }: File): void {
  if (errors.value[FILES]) return;
  const what = `${name} is a motion capture, and no radar file is open that it could belong to.`;
  const advice = "Open the radar.csv first, or bring in both together.";
  setError(FILES, { code: "bad_request", what, where: name, advice });
}

async function keep(files: readonly File[]): Promise<void> {
  for (const file of files) {
    try {
      const query_ = new URLSearchParams({ filename: file.name });
      const kept = JSON.parse(await sendFile(`/api/radar/files?${query_}`, file)) as RadarFileDoc;
      choose(kept.id);
    } catch (error) {
      if (!isCancelled(error)) setError(FILES, asErrorDoc(error));
    }
  }
}

/** Gives the chosen file the configuration that its radar ran with; null takes it away. */
export async function setCfg(file: File | null): Promise<void> {
  const id = chosenId.value;
  if (id === null) return;
  try {
    if (file === null) await order({ place: READING, path: `${path(id)}/cfg`, method: "DELETE" });
    else await sendFile(`${path(id)}/cfg?${new URLSearchParams({ filename: file.name })}`, file, "PUT");
    open();
  } catch (error) {
    if (!isCancelled(error)) setError(READING, asErrorDoc(error));
  }
}

export async function remove(id: string): Promise<void> {
  const gone = await order({ place: FILES, path: path(id), method: "DELETE" });
  if (gone === null || chosenId.value !== id) return;
  chosenId.value = null;
  open();
}

/** What is no longer there cannot be looked at. */
radarFiles.subscribe((files) => {
  const id = chosenId.peek();
  if (files === null || id === null || files.some((file) => file.id === id)) return;
  chosenId.value = null;
  open();
});
