import { setSection } from "../ui/Section";
import { redo, removeSelectedPoi, undo } from "../store/plans";
import { acknowledgeFirst } from "../obstacles/obstacle_orders";
import { switchSound } from "./sound";
import { openHelpPages } from "../help/HelpPages";
import { chase } from "../scene/camera";
import { isObserver } from "../store/flying";
import { acknowledgeElsewhere, calling } from "../store/fleet";
import { acknowledgeBreach, isBreachCalling } from "../store/breach";
import { acknowledgeLoss, isLossCalling } from "../store/losses";
import { isAlarming } from "../store/obstacles";
import { seekBy, togglePlaying } from "../store/review";
import { stepFrame } from "../studies/radar";
import { sound } from "../store/prefs";
import { document_, selection } from "../store/state";
import { removeMark } from "../store/fence";
import { chooseVehicle, frame, setSelection } from "../store/stream";
import { drawer, goTo, openDialog, study, viewId } from "../store/view";
import { chooseFiles } from "../ui/choose_files";
import { afterG, pressedAt_ms, shortcutOf, type Hit } from "./shortcuts";
import { activeView } from "./views";

let pressedG_ms = -Infinity;

function toggleSection(number: number): void {
  const id = activeView.value.sections[number - 1];
  if (!id) return;
  const body = document.getElementById(`section-${id}`);
  setSection(id, body === null);
  const header = document.querySelector<HTMLElement>(`[data-section=${id}] > h2 > button`);
  header?.focus();
  // Its content is there after the next frame; tall sections show their beginning.
  requestAnimationFrame(() => {
    header?.closest(".section")?.querySelector(".section-body")?.scrollIntoView({ block: "nearest" });
    header?.scrollIntoView({ block: "nearest" });
  });
}

function stop(): void {
  if (drawer.value) drawer.value = null;
  else setSelection({ tool: "select", draft: [] });
}

/** What would lead an observer to what they cannot do; all else that changes something does nothing for them. */
const NOT_FOR_OBSERVERS: ReadonlySet<Hit["id"]> = new Set(["save", "open"]);

/** What is lost before what is near, the vehicle on the page before the others. */
function acknowledgeTop(): void {
  if (isLossCalling.value) return acknowledgeLoss();
  if (isBreachCalling.value) return acknowledgeBreach();
  if (!isAlarming.value && calling.value.length > 0) return acknowledgeElsewhere();
  if (!isObserver.value) acknowledgeFirst();
}

function act(hit: Hit): void {
  if (isObserver.value && NOT_FOR_OBSERVERS.has(hit.id)) return;
  switch (hit.id) {
    case "undo":
      return void undo();
    case "redo":
      return void redo();
    case "save":
      openDialog.value = "save_as";
      return;
    case "open":
      return chooseFiles();
    case "add":
      if (document_.value?.terrain_id) setSelection({ tool: "add_poi", draft: [] });
      return;
    case "select":
      return stop();
    case "delete":
      return selection.value.fence_mark
        ? removeMark(selection.value.fence_mark)
        : removeSelectedPoi(selection.value.poi_id);
    case "fit":
      return void frame("plan");
    case "top":
      return void frame("top");
    case "chase":
      return chase();
    case "section":
      return toggleSection(hit.section ?? 0);
    case "view":
      return goTo(hit.view ?? "plan");
    case "vehicle":
      return chooseVehicle(hit.vehicle ?? 1);
    case "acknowledge":
      return acknowledgeTop();
    case "sound":
      return void switchSound(!sound.value);
    case "play":
      return togglePlaying();
    case "seek":
      return seekBy(hit.by_s ?? 0);
    case "frame":
      return stepFrame(hit.by ?? 0);
    case "pages":
      return openHelpPages();
    case "help":
      openDialog.value = "help";
  }
}

function isInput(target: EventTarget | null): boolean {
  const element = target as HTMLElement | null;
  return /^(INPUT|TEXTAREA|SELECT)$/.test(element?.tagName ?? "") || Boolean(element?.isContentEditable);
}

/** Space and the arrows belong to what has the focus if that uses them itself. */
function isControl(event: KeyboardEvent): boolean {
  const element = event.target as HTMLElement | null;
  return event.key === " " && /^(BUTTON|A|SUMMARY)$/.test(element?.tagName ?? "");
}

/** Held down on the way to another key, they are none themselves. */
const isModifier = (key: string) => /^(Shift|Control|Alt|Meta|CapsLock)$/.test(key);

/** Listens on our page, and through the 3D view on its page as well. */
export function onKey(event: KeyboardEvent): void {
  if (openDialog.value !== null || event.altKey || event.defaultPrevented || isModifier(event.key)) return;
  const key = { key: event.key, mod: event.ctrlKey || event.metaKey, shift: event.shiftKey };
  const inInput = isInput(event.target);
  const at_ms = pressedAt_ms(event);
  const follows = afterG(pressedG_ms, at_ms);
  pressedG_ms = event.key.toLowerCase() === "g" && !key.mod && !inInput ? at_ms : -Infinity;
  const hit = shortcutOf(key, inInput, {
    view: viewId.value,
    study: study.value,
    afterG: follows,
  });
  if (!hit || isControl(event)) return;
  event.preventDefault();
  act(hit);
}

/** From the page's first moment on: what is pressed before its first picture counts as well. */
export const startKeyboard = () => document.addEventListener("keydown", onKey);
