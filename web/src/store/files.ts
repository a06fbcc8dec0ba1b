import { signal } from "@preact/signals";
import type { Imported, JobDoc, RecordingDoc, UwbRule } from "../messages";
import { asErrorDoc, isCancelled, upload, type Upload } from "../net/api";
import { allSent, queue, showPlan } from "./plan";
import { folderOf } from "./dropped";
import { act } from "./outcomes";
import { jobs, notifyText, setError, terrain } from "./state";

/** A file on its way to the server, before there is a job for it. */
export interface Sending {
  id: number;
  name: string;
  share: number;
  cancel: () => void;
}

export interface SentFile {
  file: File;
  hints: RasterHints;
  /** The open plan takes the model whatever it had: it is the same one, read again. */
  replaces: boolean;
}

/** What the operator declares about a surface model whose file does not say it. */
export interface RasterHints {
  crs: string;
  z_scale: string;
  vertical_datum: string;
  remove_spikes: boolean;
  /** Of a point cloud's model; empty: by its density. */
  cell_m: string;
  /** Points that the cloud calls noise count as well. */
  keep_noise: boolean;
}

export const NO_HINTS: RasterHints = {
  crs: "",
  z_scale: "",
  vertical_datum: "",
  remove_spikes: false,
  cell_m: "",
  keep_noise: false,
};

/** What is made a surface model of; told for sure by its content, on the server. */
export const isCloud = (name: string) => /\.(las|laz|ply|pcd|e57)$/i.test(name);
export const MODEL_FILES = ".tif,.tiff,.asc,.txt,.zip,.las,.laz,.ply,.pcd,.e57,.glb,.gltf";

export const sending = signal<Sending[]>([]);
/** Files by the job that reads them: kept so that a file can be sent again with what was missing. */
export const sentFiles = signal<ReadonlyMap<string, SentFile>>(new Map());

const POINT_FILES = /\.(csv|geojson|json|kml|kmz|waypoints|plan|txt)$/i;
const MOST_POINT_BYTES = 20e6;
let nextId = 1;

export async function sendFile(path: string, file: File, method: "POST" | "PUT" = "POST"): Promise<string> {
  const id = nextId++;
  const show = (share: number) => {
    sending.value = sending.value.map((entry) => (entry.id === id ? { ...entry, share } : entry));
  };
  const running: Upload = upload(path, file, show, method);
  sending.value = [...sending.value, { id, name: file.name, share: 0, cancel: running.cancel }];
  try {
    return await running.done;
  } finally {
    sending.value = sending.value.filter((entry) => entry.id !== id);
  }
}

function report(place: string, error: unknown): void {
  if (!isCancelled(error)) setError(place, asErrorDoc(error));
}

/** Sends a surface model; reading it becomes a job. */
export async function sendTerrain(
  file: File,
  hints: RasterHints = NO_HINTS,
  replaces = false,
): Promise<void> {
  setError("terrain", null);
  const query = new URLSearchParams({ filename: file.name, folder: folderOf(file) });
  if (file.lastModified) query.set("file_utc", new Date(file.lastModified).toISOString());
  if (hints.crs) query.set("crs", hints.crs);
  if (hints.z_scale) query.set("z_scale", hints.z_scale);
  if (hints.vertical_datum) query.set("vertical_datum", hints.vertical_datum);
  if (hints.remove_spikes) query.set("remove_spikes", "true");
  if (hints.cell_m) query.set("cell_m", hints.cell_m);
  if (hints.keep_noise) query.set("keep_noise", "true");
  try {
    const job = JSON.parse(await sendFile(`/api/terrains?${query}`, file)) as JobDoc;
    sentFiles.value = new Map(sentFiles.value).set(job.id, { file, hints, replaces });
    addJob(job);
  } catch (error) {
    report("terrain", error);
  }
}

export async function sendOrthophoto(file: File): Promise<void> {
  setError("terrain", null);
  const query = new URLSearchParams({ filename: file.name, terrain_id: terrain.value?.id ?? "" });
  try {
    addJob(JSON.parse(await sendFile(`/api/orthophotos?${query}`, file)) as JobDoc);
  } catch (error) {
    report("terrain", error);
  }
}

/** Points, the polygon of a survey, or a fence from a file. */
export const sendPoints = (file: File) => importIntoPlan(file, "points", {});

/** Of a file that may hold a mission as well, only its fence and rally points. */
export const sendFence = (file: File) => importIntoPlan(file, "fence", { only_fence: "true" });

async function importIntoPlan(file: File, place: string, asked: Record<string, string>): Promise<void> {
  setError(place, null);
  if (file.size > MOST_POINT_BYTES) {
    const what = `"${file.name}" is larger than 20 MB.`;
    setError(place, { code: "too_large", what, where: file.name, advice: "Split it or thin it out." });
    return;
  }
  try {
    await allSent();
    const path = `/api/plan/import?${new URLSearchParams({ filename: file.name, ...asked })}`;
    const imported = JSON.parse(await sendFile(path, file)) as Imported;
    queue.takeAnswer(imported.state);
    showPlan();
    imported.warnings.forEach((warning) => notifyText("warning", warning, `Check ${file.name}.`));
    notifyText("info", `Read from ${file.name}: ${imported.taken}.`);
  } catch (error) {
    report(place, error);
  }
}

/** A recording of a flight; `then` gets it once the library has it. */
export async function sendRecording(file: File, then: (recording: RecordingDoc) => void): Promise<void> {
  setError("recordings", null);
  try {
    const path = `/api/recordings/import?${new URLSearchParams({ filename: file.name })}`;
    then(JSON.parse(await sendFile(path, file)) as RecordingDoc);
  } catch (error) {
    report("recordings", error);
  }
}

/** Name of the radar log that is on its way, or being worked on before the server says so. */
export const radarLog = signal<string | null>(null);

/** What of a rule is set, for a query. */
export const ruleQuery = (rule: UwbRule): [string, string][] =>
  Object.entries(rule).flatMap(([key, value]): [string, string][] =>
    value === null || value === undefined ? [] : [[key, String(value)]],
  );

/** A UWB radar's log, to clear the foliage; whether the server took it. */
export async function sendRadarLog(file: File, rule: UwbRule): Promise<boolean> {
  setError("traversability", null);
  radarLog.value = file.name;
  try {
    const query = new URLSearchParams([["name", file.name], ...ruleQuery(rule)]);
    await sendFile(`/api/traversability/uwb?${query}`, file);
    return true;
  } catch (error) {
    report("traversability", error);
    return false;
  } finally {
    radarLog.value = null;
  }
}

export const isRadarLog = (file: File) => /\.npz$/i.test(file.name);

/** Any dropped file but a recording: points by their ending, everything else is tried as a surface model. */
export function takeFiles(files: Iterable<File>): void {
  for (const file of files) void (POINT_FILES.test(file.name) ? sendPoints(file) : sendTerrain(file));
}

/** How an ArduPilot log begins: raw radar samples have the same ending. */
const DATAFLASH = [0xa3, 0x95];

/** The list of its files ends a ZIP. */
const ZIP_TAIL_BYTES = 65_536;

/** Whether the end of a ZIP names parts of a bag of ROS; any other is taken for tiles of a surface model. */
export const namesBag = (tail: string) => /\.(bag|db3|mcap)|metadata\.yaml/i.test(tail);

async function isBagArchive(file: File): Promise<boolean> {
  const tail = await file.slice(Math.max(0, file.size - ZIP_TAIL_BYTES)).arrayBuffer();
  return namesBag(new TextDecoder("latin1").decode(tail));
}

async function isRecording(file: File): Promise<boolean> {
  if (/\.zip$/i.test(file.name)) return isBagArchive(file);
  if (!/\.bin$/i.test(file.name)) return /\.(tlog|mcap|ulg|bag|db3)$/i.test(file.name);
  const head = new Uint8Array(await file.slice(0, DATAFLASH.length).arrayBuffer());
  return DATAFLASH.every((byte, index) => head[index] === byte);
}

/** Which of the files are flights: recordings, logs of ground stations and vehicles, and bags of robots. */
export async function recordingsAmong(files: readonly File[]): Promise<ReadonlySet<File>> {
  const found = await Promise.all(files.map((file) => isRecording(file).catch(() => false)));
  return new Set(files.filter((_, index) => found[index]));
}

/** The file that a terrain was read from, if this page sent it. */
export function sentFileOf(name: string): SentFile | null {
  return [...sentFiles.value.values()].reverse().find((sent) => sent.file.name === name) ?? null;
}

export function forgetJob(id: string): void {
  const [left, files] = [new Map(jobs.value), new Map(sentFiles.value)];
  left.delete(id);
  files.delete(id);
  jobs.value = left;
  sentFiles.value = files;
}

function addJob(job: JobDoc): void {
  if (!jobs.value.has(job.id)) jobs.value = new Map(jobs.value).set(job.id, job);
}

export async function cancelJob(id: string): Promise<void> {
  await act("POST", `/api/jobs/${id}/cancel`, "jobs");
}
