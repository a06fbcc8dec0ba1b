import { signal } from "@preact/signals";
import type { BagDoc, BagRecordedDoc, BagRecordingBody } from "../messages";
import { asErrorDoc, isCancelled, requestJson } from "../net/api";
import { sendFile } from "./files";
import { imported } from "./review";
import { act } from "./outcomes";
import { notifyText, setError } from "./state";

/** Where errors of bags appear. */
export const BAGS = "bags";
/** A long bag is read and judged as long as it takes; the job can be cancelled. */
const LONGEST_MS = 30 * 60_000;

/** Bags that the station keeps, newest first. */
export const bags = signal<readonly BagDoc[]>([]);
/** Bags of which a recording is being made. */
export const making = signal<ReadonlySet<string>>(new Set());

const MCAP = "\x89MCAP0\r\n";
const MCAP_HEADER = MCAP.length + 9;
const HEAD_BYTES = 1024;

/** Whether a file is a bag of ROS, by how it begins; an archive may hold one. */
export function startsAsBag(head: Uint8Array): boolean {
  const text = String.fromCharCode(...head);
  if (text.startsWith(MCAP)) return !isOwn(head, text);
  return ["#ROSBAG V2.0", "SQLite format 3\0", "PK\x03\x04"].some((magic) => text.startsWith(magic));
}

/** A recording of Hedgehop's, by the library that its first record names; what is written for ROS has a profile. */
function isOwn(head: Uint8Array, text: string): boolean {
  if (head.length < MCAP_HEADER + 8) return false;
  const words = new DataView(head.buffer, head.byteOffset);
  const profile = words.getUint32(MCAP_HEADER, true);
  return profile === 0 && text.startsWith("hedgehop", MCAP_HEADER + 8);
}

export async function isBag(file: File): Promise<boolean> {
  if (/\.(bag|db3|zip)$/i.test(file.name)) return true;
  if (!/\.mcap$/i.test(file.name)) return false;
  return startsAsBag(new Uint8Array(await file.slice(0, HEAD_BYTES).arrayBuffer()));
}

export async function sendBag(file: File): Promise<void> {
  setError(BAGS, null);
  try {
    const query = new URLSearchParams({ filename: file.name });
    const bag = JSON.parse(await sendFile(`/api/bags?${query}`, file)) as BagDoc;
    bags.value = [bag, ...bags.value];
    await loadBags(); // an older one may have had to go
  } catch (error) {
    if (!isCancelled(error)) setError(BAGS, asErrorDoc(error));
  }
}

/** What is kept from before this page was loaded can be used, and put away. */
export async function loadBags(): Promise<void> {
  try {
    bags.value = await requestJson<BagDoc[]>("GET", "/api/bags");
  } catch (error) {
    if (!isCancelled(error)) setError(BAGS, asErrorDoc(error));
  }
}

const mark = (id: string, isOn: boolean) => {
  const next = new Set(making.value);
  if (isOn) next.add(id);
  else next.delete(id);
  making.value = next;
};

/** Makes a recording of a bag and opens it. */
export async function recordBag(bag: BagDoc, body: BagRecordingBody): Promise<void> {
  setError(BAGS, null);
  mark(bag.id, true);
  try {
    const path = `/api/bags/${bag.id}/recording`;
    const made = await requestJson<BagRecordedDoc>("POST", path, body, { limit_ms: LONGEST_MS });
    made.notes.forEach((note) => notifyText("info", note));
    imported(made.recording);
  } catch (error) {
    if (!isCancelled(error)) setError(BAGS, asErrorDoc(error));
  } finally {
    mark(bag.id, false);
  }
}

export async function putAway(bag: BagDoc): Promise<void> {
  await act("DELETE", `/api/bags/${bag.id}`, BAGS);
  await loadBags();
}
