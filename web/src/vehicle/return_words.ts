import { duration } from "../format";
import type { ReturnDoc } from "../messages";
import { home } from "../store/home";
import { serverNow_s } from "../store/server_clock";

/** What is said of the vehicle's own return since home was moved in flight. */

const WORDS: Record<ReturnDoc["state"], string> = {
  certified: "Return certified",
  not_certified: "RETURN NOT CLEAR",
  unknown: "RETURN NOT JUDGED",
};

export const returnWords = (state: ReturnDoc["state"]) => WORDS[state];

/** How long ago it was judged; null while the server's clock is not known. */
export function returnAge_s(ret: ReturnDoc, now_ms: number): number | null {
  const now_s = serverNow_s(now_ms);
  return now_s === null ? null : Math.max(0, now_s - ret.judged_mono_s);
}

/** What the button Return says of itself since home was moved; null: nothing. What is judged anew is not called clear. */
export function returnTitle(now_ms: number): string | null {
  const { ret, is_judging_return } = home.value;
  if (!ret) return is_judging_return ? "Home was moved: the return is being judged" : null;
  const age_s = returnAge_s(ret, now_ms);
  const when = is_judging_return ? ", being judged anew" : age_s === null ? "" : `, ${duration(age_s)} ago`;
  const first = ret.reasons[0];
  return `${WORDS[ret.state]}${when}${ret.state !== "certified" && first ? `: ${first.text}` : ""}`;
}
