import type {
  AcknowledgeBody,
  AvoidanceStatus,
  ManoeuvreDoc,
  PerceptionSettingsBody,
  PlanState,
  PlanWithSeen,
  SetAvoidanceBody,
} from "../messages";
import { order, say } from "../store/outcomes";
import { alerts } from "../store/obstacles";
import { allSent, queue, showPlan } from "../store/plan";
import { errors } from "../store/state";

/** Everything that is asked of the server about obstacles, each with the place where its outcome appears. */

export const ALERTS = "alerts";
export const AVOIDANCE = "avoidance";
export const MANOEUVRE = "manoeuvre";
export const MAPS = "obstacles";
export const MAP_SETTINGS = "map-settings";
export const SEEN = "seen";

/** One alert, or all of them. */
export function acknowledge(alert_id: string | null): Promise<Response | null> {
  const body: AcknowledgeBody = { alert_id };
  return order({ place: ALERTS, path: "/api/obstacles/acknowledge", body });
}

/** The one that stands on top, by its key. */
export function acknowledgeFirst(): void {
  const first = alerts.live.value.find((entry) => !entry.acknowledged);
  if (first) void acknowledge(first.alert.id);
}

export async function switchAvoidance(
  enabled: boolean,
  by: AvoidanceStatus["by"],
  consent = false,
): Promise<boolean> {
  const body: SetAvoidanceBody = { enabled, consent, by };
  const done = enabled ? "Avoidance is on." : "Avoidance is off.";
  const answer = await order({
    place: AVOIDANCE,
    method: "PUT",
    path: "/api/obstacles/avoidance",
    moves: true,
    body,
    done,
  });
  return answer !== null;
}

/** The server wants it in words: this is a real vehicle. */
export function wantsConsent(): boolean {
  const error = errors.value[AVOIDANCE];
  return error !== undefined && /consent/i.test(`${error.code} ${error.what} ${error.advice}`);
}

const FLOWN: Record<ManoeuvreDoc["kind"], string> = {
  over: "The vehicle flies over it.",
  around: "The vehicle flies around it.",
  sidestep: "The vehicle steps aside.",
};

export const flyManoeuvre = (id: string, kind: ManoeuvreDoc["kind"]) =>
  order({
    place: MANOEUVRE,
    path: `/api/obstacles/manoeuvre/${encodeURIComponent(id)}/fly`,
    moves: true,
    done: FLOWN[kind],
  });

export function setPerception(body: PerceptionSettingsBody, place = MAPS): Promise<Response | null> {
  return order({ place, method: "PUT", path: "/api/obstacles/settings", body });
}

export const clearMaps = () =>
  order({ place: MAPS, path: "/api/obstacles/clear", done: "The maps begin anew." });

export type SeenPart = NonNullable<PlanWithSeen["part"]>;

const PLANNED: Record<SeenPart, string> = {
  whole: "What was seen is in the plan's surface model.",
  ahead: "Planned from where the vehicle was, past what was seen.",
  home: "The way home is planned past what was seen.",
};

/** With what it lacks, if anything. */
export const plannedWords = (part: SeenPart, lacks: string): string =>
  lacks ? `${PLANNED[part]} Not all: ${lacks}` : PLANNED[part];

/** Takes what was seen into the open plan's surface model, or out of it again: an edit that can be undone. */
export async function planWithSeen(seen: boolean, part: SeenPart = "whole"): Promise<void> {
  await allSent();
  const body: PlanWithSeen = { seen, part };
  const answer = await order({ place: SEEN, method: "PUT", path: "/api/obstacles/seen", body });
  if (!answer) return;
  const state = (await answer.json()) as PlanState;
  say(SEEN, seen ? plannedWords(part, state.document.seen_lacks) : "The plan is on the surface model alone.");
  queue.takeAnswer(state);
  showPlan();
}
