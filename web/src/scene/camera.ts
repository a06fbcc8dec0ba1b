import { computed, effect } from "@preact/signals";
import { heard } from "../store/flying";
import { isReplaying } from "../store/review";
import { link, pageId } from "../store/state";
import { follows, frame } from "../store/stream";
import { viewId } from "../store/view";

/** The camera in flight: behind the vehicle by default, and elsewhere for as long as the operator wants it so. */

const hasPlace = {
  live: computed(() => heard.live.value?.message.state?.lat_deg != null),
  replay: computed(() => heard.replay.value?.message.state?.lat_deg != null),
};

/** Whom the camera would follow in the present view; null: nobody is there. Told once, values change all the time. */
export const followed = computed(() => {
  if (viewId.value === "review" && isReplaying.value) return hasPlace.replay.value ? "replay" : null;
  return hasPlace.live.value ? "live" : null;
});

export function chase(): void {
  if (followed.value) frame("chase", followed.value);
}

/** A server that is silent for a while has not forgotten where this page's camera is. */
const isConnected = computed(() => link.value === "open" || link.value === "silent");

/** On the way into Fly, and when its vehicle appears there; on the way out the plan is looked at again. */
export function startFollowing(): void {
  effect(() => {
    const flies = viewId.value === "fly" && pageId.value !== null && isConnected.value;
    if (flies && followed.value === "live") frame("chase", "live");
    else if (!flies && follows.peek()) frame("plan");
  });
}
