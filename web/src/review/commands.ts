import { signal } from "@preact/signals";
import type { PlayReview, RecordingDoc } from "../messages";
import { asErrorDoc } from "../net/api";
import { order } from "../store/outcomes";
import { isPlaying, opening, playhead, replay, review, seeking } from "../store/review";
import { notifyText, setError } from "../store/state";

/** Recordings and the replay: what this page asks of the server. */

export const RECORDINGS = "recordings";
export const PLAYING = "replay";

/** What a flight is judged against; kept until another recording is opened. */
export const terrainChoice = signal<string | null>(null);
export const againstOpenPlan = signal(false);

export const SPEEDS = [0.5, 1, 2, 5, 10, 20] as const;

export async function openReview(recording_id: string): Promise<void> {
  const isSame = review.value?.recording.id === recording_id;
  if (!isSame) terrainChoice.value = null;
  const body = { recording_id, terrain_id: terrainChoice.value, use_open_plan: againstOpenPlan.value };
  opening.value = recording_id;
  await order({ place: RECORDINGS, path: "/api/review/open", body });
  opening.value = null;
}

export const closeReview = () => order({ place: RECORDINGS, path: "/api/review/close" });

export const deleteRecording = (id: string) =>
  order({ place: RECORDINGS, path: `/api/recordings/${encodeURIComponent(id)}`, method: "DELETE" });

export const fileOf = (recording: RecordingDoc) => `/api/recordings/${encodeURIComponent(recording.id)}/file`;

/** Only the latest of what is asked in quick succession is sent: a drag asks for many places. */
class LatestOnly {
  private isBusy = false;
  private waiting: PlayReview | null = null;

  async send(body: PlayReview): Promise<void> {
    if (this.isBusy) {
      this.waiting = { ...this.waiting, ...body };
      return;
    }
    this.isBusy = true;
    await order({ place: PLAYING, path: "/api/review/play", body });
    this.isBusy = false;
    const next = this.waiting;
    this.waiting = null;
    if (next) await this.send(next);
  }
}

const requests = new LatestOnly();

function report(error: unknown): void {
  setError(PLAYING, asErrorDoc(error));
}

const ask = (body: PlayReview) => void requests.send(body).catch(report);

export const length_s = () => review.value?.duration_s ?? 0;

export function togglePlaying(): void {
  if (!review.value) return;
  const at_s = playhead(replay.value, performance.now()) ?? 0;
  const isAtEnd = at_s >= length_s() - 0.05;
  ask(isPlaying.value ? { playing: false } : { playing: true, ...(isAtEnd ? { at_s: 0 } : {}) });
}

export const setSpeed = (speed: number) => ask({ playing: isPlaying.value, speed });

/** A jump that the replay never confirms is forgotten. */
const SETTLE_MS = 3000;
let settling: ReturnType<typeof setTimeout> | undefined;

/** Goes to a time; while dragging (`isOver` false) the page stays with the pointer. */
export function seek(at_s: number, isOver = true): void {
  if (!review.value) return;
  const kept_s = Math.min(length_s(), Math.max(0, at_s));
  seeking.value = { at_s: kept_s, isOver };
  ask({ playing: isPlaying.value, at_s: kept_s });
  clearTimeout(settling);
  if (isOver) settling = setTimeout(() => (seeking.value = null), SETTLE_MS);
}

export function seekBy(by_s: number): void {
  const at_s = seeking.value?.at_s ?? playhead(replay.value, performance.now());
  if (at_s !== null) seek(at_s + by_s);
}

/** A file dropped or chosen: it is imported, then opened. */
export function imported(recording: RecordingDoc): void {
  notifyText("info", `${recording.name} imported.`, recording.fault);
  void openReview(recording.id);
}
