import { computed, signal } from "@preact/signals";
import type { CheckRow, LeaseDoc, ResumeFlight, StartFlight, TakeUpPlan } from "../messages";
import { fly } from "../store/flying";
import { order, say } from "../store/outcomes";
import { allSent } from "../store/plan";
import { verdictOf, type VerdictKind } from "../store/results";
import { isFresh, plan } from "../store/state";

/** Everything that is asked of the vehicle from this page, each with the place where its outcome appears. */

export type Accepted = NonNullable<StartFlight["accept"]>[number];

/** What the operator chose for the next start. */
export const way = signal<"auto" | "guided">("auto");
const checkedAt = () => fly.value?.preflight?.checked_utc ?? "";
/** Other vehicles come and go while a check stands: what was accepted of them is what was read then. */
const saidOfOthers = () => fly.value?.preflight?.rows.find((row) => row.code === "others")?.text ?? "";
const marks = signal<{ checked_utc: string; others: string; codes: ReadonlySet<Accepted> }>({
  checked_utc: "",
  others: "",
  codes: new Set(),
});
/** What is accepted of the present check: another check must be accepted anew. */
export const accepted = computed<ReadonlySet<Accepted>>(() => {
  const { checked_utc, others, codes } = marks.value;
  if (checked_utc !== checkedAt()) return new Set();
  return others === saidOfOthers() ? codes : new Set([...codes].filter((code) => code !== "others"));
});
/** Resume where the flight broke off, if it did. */
export const resumes = signal(true);

/** Item at which the next start goes on; null: it begins anew. */
export const resumeFrom = computed(() => (resumes.value ? (fly.value?.resume_from_item ?? null) : null));
/** A navigation script begins at the first waypoint: what broke off goes on in AUTO. */
export const wayToFly = computed(() => (resumeFrom.value === null ? way.value : "auto"));

export const isAcceptable = (code: CheckRow["code"]): code is Accepted =>
  (["gnss", "battery", "rtl_height", "avoidance", "fence", "others"] as const).some((one) => one === code);

export function accept(code: Accepted, yes: boolean): void {
  const next = new Set(accepted.value);
  if (yes) next.add(code);
  else next.delete(code);
  marks.value = { checked_utc: checkedAt(), others: saidOfOthers(), codes: next };
}

/** Pause and Return stand in the status bar, in every view. */
export const SAFETY = "safety";
const FLIGHT = "flight";
export const NEXT = "next";

export const holdPosition = () =>
  order({ place: SAFETY, path: "/api/flight/pause", moves: true, done: "The vehicle holds its position." });
export const returnHome = () =>
  order({ place: SAFETY, path: "/api/flight/return", moves: true, done: "The vehicle returns home." });

export const arm = () => order({ place: FLIGHT, path: "/api/flight/arm", moves: true, done: "Armed." });
export const disarm = () =>
  order({ place: FLIGHT, path: "/api/flight/disarm", moves: true, done: "Disarmed." });
export const land = () =>
  order({ place: FLIGHT, path: "/api/flight/land", moves: true, done: "The vehicle lands here and now." });

/** Of its own: an order before it that is not answered holds up no emergency stop. */
export const EMERGENCY = "emergency";

export const stopMotors = () =>
  order({ place: EMERGENCY, path: "/api/flight/emergency", moves: true, done: "The motors are stopped." });

export const pauseFlight = () =>
  order({ place: NEXT, path: "/api/flight/pause", moves: true, done: "Paused: it holds its position." });

/** What is said of other vehicles where a plan was taken up, as it was accepted. */
const othersAccepted = signal("");
const others = () => fly.value?.taken_up?.others ?? null;
export const areOthersAccepted = () => others() !== null && othersAccepted.value === others()?.text;
export const acceptOthers = (yes: boolean) => (othersAccepted.value = yes ? (others()?.text ?? "") : "");

/** Why a plan that was taken up is not resumed now. */
export function resumeObstacle(row: CheckRow | null | undefined, isAccepted: boolean): string | undefined {
  if (!row || row.state === "good" || (row.state === "accept" && isAccepted)) return undefined;
  return row.state === "accept" ? "Tick what you accept under On board first" : row.text;
}

export function resumeFlight() {
  const body: ResumeFlight = { accept: areOthersAccepted() ? ["others"] : [] };
  return order({ place: NEXT, path: "/api/flight/resume", moves: true, body, done: "The flight goes on." });
}

/** Why nothing can be uploaded, by the verdict on the open plan. */
export function uploadObstacle(verdict: VerdictKind): string | null {
  if (verdict === "none") return "Plan a path first";
  if (verdict === "error") return "The plan has an error: see Plan";
  if (verdict === "not_certified") return "The plan is NOT CERTIFIED: mend it in Plan";
  return verdict === "computing" ? "Computing the plan…" : null;
}

/** Why the open plan cannot be uploaded now. */
export const uploadRefusal = () => uploadObstacle(verdictOf(plan.value, isFresh.value));

export async function uploadPlan(place: string): Promise<void> {
  await allSent();
  const revision = plan.value?.revision;
  if (revision === undefined) return;
  // What is on board comes by the stream alone: by now the answer may be older than what was told since.
  const answer = await order({ place, path: "/api/flight/upload", body: { revision } });
  if (answer) say(place, "On board: read back and verified.");
}

/** Holds first, whatever comes of it; the answer to a refusal says what is on board then. */
export async function takeUpPlan(acceptsBattery: boolean): Promise<void> {
  await allSent();
  const revision = plan.value?.revision;
  if (revision === undefined) return;
  const body: TakeUpPlan = { revision, accept: acceptsBattery ? ["battery"] : [] };
  const answer = await order({ place: NEXT, path: "/api/flight/take_up", moves: true, body });
  if (answer) say(NEXT, "The new plan is on board, certified from here. Resume flies it.");
}

/** Of its own: the order that is cancelled is still being waited for. */
export const CANCEL = "take_up_cancel";

export const cancelTakeUp = () =>
  order({ place: CANCEL, method: "DELETE", path: "/api/flight/take_up", moves: true });

export const checkStart = () => order({ place: NEXT, path: "/api/flight/check" });

export async function startFlight(): Promise<void> {
  const digest = fly.value?.onboard.digest;
  if (!digest) return;
  const body: StartFlight = {
    way: wayToFly.value,
    digest,
    accept: [...accepted.value],
    from_item: resumeFrom.value ?? 1,
  };
  await order({ place: NEXT, path: "/api/flight/start", body, done: "Started." });
}

const CONNECTION = "connection";

export const connectTo = (address: string, asWay: boolean) =>
  order({ place: CONNECTION, path: "/api/link/connect", body: { address, adopt: !asWay, as_way: asWay } });
export const disconnect = (address: string) =>
  order({ place: CONNECTION, path: "/api/link/disconnect", body: { address } });
export const adopt = (candidate: string) =>
  order({ place: CONNECTION, path: "/api/link/adopt", body: { candidate } });
export const SIGNING = "signing";
export const release = () => order({ place: CONNECTION, path: "/api/link/release" });
export const setSigning = (enabled: boolean) =>
  order({ place: SIGNING, path: "/api/link/signing", body: { enabled } });
export const startSimulator = (place: string) => order({ place, path: "/api/link/simulator" });

export const LEASE = "lease";
export async function takeControl(): Promise<void> {
  const answer = await order({ place: LEASE, path: "/api/lease/take" });
  if (!answer) return;
  const { mine, holder } = (await answer.json()) as LeaseDoc;
  say(LEASE, mine ? "You are in charge." : `${holder ?? "Who is in charge"} has been asked.`);
}
/** Lets go, or asks no more. */
export const giveControl = () => order({ place: LEASE, path: "/api/lease/release" });
export const handOver = () => order({ place: LEASE, path: "/api/lease/hand_over" });
export const keepControl = () => order({ place: LEASE, path: "/api/lease/keep" });

export const startRecording = () => order({ place: "recorder", path: "/api/recorder/start" });
export const stopRecording = () => order({ place: "recorder", path: "/api/recorder/stop" });
