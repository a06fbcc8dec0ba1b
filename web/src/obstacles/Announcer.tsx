import { useRef } from "preact/hooks";
import { alerts } from "../store/obstacles";
import { spoken } from "./words";

/** Says each alert once when it begins and once when it is over; figures that go on changing are not read out. */
export function Announcer() {
  const told = useRef({ key: "", text: "" });
  const first = alerts.live.value[0];
  const key = first ? `${first.alert.id} ${first.over}` : "";
  if (key !== told.current.key) told.current = { key, text: first ? spoken(first) : "" };
  return (
    <p class="visually-hidden" role="alert" aria-live="assertive" data-testid="alert-spoken">
      {told.current.text}
    </p>
  );
}
