import { signal } from "@preact/signals";
import { LIMITS, type FlyWayBody, type PlaceDoc, type WayBody } from "../messages";
import { guided } from "../store/guided";
import { order } from "../store/outcomes";
import { document_ } from "../store/state";
import { aim } from "../vehicle/aiming";

/** Everything that is asked of guided flight from this page. */

export type WayAction = WayBody["action"];
export const GUIDED = "guided";

export const action = signal<WayAction>("to");
export const height_m = signal<number>(LIMITS.WayBody.height_m.initial);
export const radius_m = signal<number>(LIMITS.WayBody.radius_m.initial);
export const laps = signal<number>(LIMITS.WayBody.laps.initial);
export const isClockwise = signal(true);
/** As it is typed; null: the mean speed of the plan's vehicle. */
export const speed_m_s = signal<number | null>(null);

export const isAtPlace = (asked: WayAction) => asked === "to" || asked === "look" || asked === "orbit";

export const wantedSpeed_m_s = () => speed_m_s.value ?? document_.value?.profile.mean_speed_m_s ?? null;

/** What is asked for, from what is set on this page. */
export function wish(asked: WayAction, place: PlaceDoc | null): WayBody {
  return {
    action: asked,
    place,
    height_m: height_m.value,
    radius_m: radius_m.value,
    laps: laps.value,
    clockwise: isClockwise.value,
    speed_m_s: speed_m_s.value,
  };
}

/** Nothing moves yet: the way is laid and judged, and shown to all pages. */
export async function ask(asked: WayAction, place: PlaceDoc | null = null): Promise<void> {
  // What is judged is told by the stream alone: by now the answer may be older.
  await order({ place: GUIDED, method: "PUT", path: "/api/flight/way", body: wish(asked, place) });
}

export const flyWay = (id: string, accept_return: boolean) => {
  const body: FlyWayBody = { id, accept_return };
  return order({ place: GUIDED, path: "/api/flight/way/fly", body, moves: true, done: "It flies the way." });
};

export const putAway = () => order({ place: GUIDED, method: "DELETE", path: "/api/flight/way" });

export const setWaySpeed = (value_m_s: number) =>
  order({
    place: GUIDED,
    method: "PUT",
    path: "/api/flight/way/speed",
    body: { speed_m_s: value_m_s },
    moves: true,
    done: "The speed is changed.",
  });

export const takeAim = () =>
  aim("way", (place) => {
    if (!guided.peek().is_judging) void ask(action.peek(), place);
  });
