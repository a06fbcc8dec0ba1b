import { signal } from "@preact/signals";
import type { ClientMessage, FrameView, SelectionDoc, ViewDoc } from "../messages";
import { goToSignIn } from "../net/api";
import { Stream, streamUrl } from "../net/socket";
import { active, fleet } from "./fleet";
import { isObserver } from "./flying";
import { giveUpOrders } from "./outcomes";
import { receive } from "./reduce";
import { nextChange } from "./shared";
import { cursor, link, notifyText, selection, view } from "./state";

const stream = new Stream(streamUrl(location), {
  message: receive,
  link: (state) => {
    link.value = state;
    if (state === "open") return;
    cursor.value = null;
    giveUpOrders();
  },
  signIn: goToSignIn,
  unreadable: (why) => notifyText("error", `The server sent ${why}.`, "Reload the page."),
});

export const connect = () => stream.connect();

export const send = (message: ClientMessage) => stream.send(message);

export function setView(fields: Partial<ViewDoc>): void {
  if (isObserver.value) return;
  view.value = { ...view.value, ...fields };
  send({ type: "set_view", view: view.value, change: nextChange() });
}

export function setSelection(fields: Partial<SelectionDoc>): void {
  if (isObserver.value) return;
  selection.value = { ...selection.value, ...fields };
  send({ type: "set_selection", selection: selection.value, change: nextChange() });
}

/** Shows another vehicle; who is in charge of which one stays as it is. */
export function chooseVehicle(vehicle: number): void {
  const isThere = fleet.value.some(({ number }) => number === vehicle);
  if (isThere && vehicle !== (stream.wanted ?? active.value)) send({ type: "choose_vehicle", vehicle });
}

export type FrameTarget = FrameView["target"];

/** Whether this page's camera follows a vehicle. */
export const follows = signal(false);

/** Where this page's camera goes; `source`: of the vehicle that it follows. */
export function frame(target: FrameTarget, source: FrameView["source"] = "live"): boolean {
  follows.value = target === "chase";
  return send({ type: "frame_view", target, source, vehicle: active.peek() });
}

export const holdCamera = (held: boolean) => {
  if (follows.peek()) send({ type: "hold_camera", held });
};
