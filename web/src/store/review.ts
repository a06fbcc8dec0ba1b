import { computed, signal } from "@preact/signals";
import type {
  PlayReview,
  RecordingDoc,
  RecordingsMessage,
  ReplayMessage,
  ReplayStatus,
  ReviewDoc,
  ReviewMessage,
} from "../messages";
import { asErrorDoc } from "../net/api";
import { now_ms } from "./clock";
import { isObserver } from "./flying";
import { forgetMoving } from "./moving";
import { forgetObstacles, forgetSensing } from "./obstacles";
import { order } from "./outcomes";
import { notifyText, setError } from "./state";

/** Recordings, the one that is open for review, and what this page asks of both. */
export type ReviewingMessage = RecordingsMessage | ReviewMessage | ReplayMessage;

export const recordings = signal<readonly RecordingDoc[] | null>(null);
export const review = signal<ReviewDoc | null>(null);
/** The recording that is being read and judged: some seconds for a long one. */
export const opening = signal<string | null>(null);
export const replay = signal<{ status: ReplayStatus; received_ms: number } | null>(null);
/** Where the operator drags or has jumped to (`isOver`), until the replay says that it has got there. */
export const seeking = signal<{ at_s: number; isOver: boolean } | null>(null);

export function takeReviewing(message: ReviewingMessage, received_ms: number): void {
  switch (message.type) {
    case "recordings":
      recordings.value = message.recordings;
      return;
    case "review":
      if (message.review?.recording.id !== review.value?.recording.id) seeking.value = null;
      if (message.review === null) {
        forgetMoving("replay");
        forgetSensing("replay");
        forgetObstacles("replay");
      }
      review.value = message.review;
      return;
    case "replay":
      replay.value = { status: message.replay, received_ms };
      if (hasArrived(message.replay)) seeking.value = null;
  }
}

/** Less than what the replay plays while its message is on the way counts as there. */
const NEAR_S = 0.5;

function hasArrived(status: ReplayStatus): boolean {
  const goal = seeking.value;
  if (!goal?.isOver) return false;
  const away_s = Math.abs(status.at_utc_s - status.start_utc_s - goal.at_s);
  return away_s <= NEAR_S * Math.max(1, status.speed);
}

/** Where a replay is at `now_ms` of this page's clock, in seconds since the recording's start. */
export function playhead(
  known: { status: ReplayStatus; received_ms: number } | null,
  now_ms: number,
): number | null {
  if (!known || known.status.recording === null) return null;
  const { start_utc_s, end_utc_s, at_utc_s, playing, speed } = known.status;
  const since_s = playing ? (Math.max(0, now_ms - known.received_ms) / 1000) * speed : 0;
  return Math.min(end_utc_s - start_utc_s, Math.max(0, at_utc_s - start_utc_s + since_s));
}

/** The time that all of the Review view shows, from the start until the replay says more; null: nothing is open. */
export const playhead_s = computed(() =>
  review.value ? (seeking.value?.at_s ?? playhead(replay.value, now_ms.value) ?? 0) : null,
);
export const isPlaying = computed(() => replay.value?.status.playing ?? false);
export const isReplaying = computed(() => review.value !== null);

/** Where errors of recordings and of the replay appear. */
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
    const answer = await order({ place: PLAYING, path: "/api/review/play", body });
    this.isBusy = false;
    const next = this.waiting;
    this.waiting = null;
    if (body.at_s !== undefined && next?.at_s === undefined) settle(answer !== null);
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
  if (!review.value || isObserver.value) return;
  const at_s = playhead(replay.value, performance.now()) ?? 0;
  const isAtEnd = at_s >= length_s() - 0.05;
  ask(isPlaying.value ? { playing: false } : { playing: true, ...(isAtEnd ? { at_s: 0 } : {}) });
}

export const setSpeed = (speed: number) => ask({ playing: isPlaying.value, speed });

/** A jump that was taken but that the replay never confirms is forgotten. */
const SETTLE_MS = 3000;
let settling: ReturnType<typeof setTimeout> | undefined;

/** The last place that was asked for is answered: a refused jump is forgotten at once. */
function settle(isTaken: boolean): void {
  clearTimeout(settling);
  if (!seeking.value?.isOver) return;
  if (isTaken) settling = setTimeout(() => (seeking.value = null), SETTLE_MS);
  else seeking.value = null;
}

/** Goes to a time; while dragging (`isOver` false) the page stays with the pointer. */
export function seek(at_s: number, isOver = true): void {
  if (!review.value || isObserver.value) return;
  const kept_s = Math.min(length_s(), Math.max(0, at_s));
  clearTimeout(settling);
  seeking.value = { at_s: kept_s, isOver };
  ask({ playing: isPlaying.value, at_s: kept_s });
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
