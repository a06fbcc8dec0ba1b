import type { HomeBody, PlaceDoc } from "../messages";
import { order } from "../store/outcomes";
import { aim } from "./aiming";

/** Everything that is asked of home from this page. */

export const HOME = "home";

/** This page waits for what it has asked: other pages, which are shown it as well, stay where they are. */
let isAsked = false;

/** Nothing is set yet: the place is judged, and shown to all pages. Without a place it is the vehicle's own. */
export async function askHome(place: PlaceDoc | null = null): Promise<void> {
  const body: HomeBody = { place };
  isAsked = true;
  if (!(await order({ place: HOME, method: "PUT", path: "/api/flight/home", body }))) isAsked = false;
}

/** True once after each question of this page. */
export function takeAnswer(): boolean {
  const wasAsked = isAsked;
  isAsked = false;
  return wasAsked;
}

export const aimAtHome = () => aim("home", (place) => void askHome(place));

export const setHome = (id: string) =>
  order({ place: HOME, path: "/api/flight/home/set", body: { id }, moves: true, done: "Home is set." });

export const putHomeAway = () => order({ place: HOME, method: "DELETE", path: "/api/flight/home" });
