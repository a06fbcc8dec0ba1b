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
import { forgetMoving } from "./moving";
import { forgetObstacles, forgetSensing } from "./obstacles";
import { order } from "./outcomes";
import { notifyText, setError } from "./state";

/** Recordings, and the one that is open for review. */
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
