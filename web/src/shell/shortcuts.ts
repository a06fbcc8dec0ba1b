import type { StudyId, ViewId } from "../store/address";

/** The keys of the console, in the order of the help sheet. `mod` is Ctrl, or Cmd on a Mac. */
export const SHORTCUTS = [
  { id: "undo", keys: "Ctrl Z", text: "Undo" },
  { id: "redo", keys: "Ctrl Shift Z or Ctrl Y", text: "Redo" },
  { id: "save", keys: "Ctrl S", text: "Save under a new name (the plan saves itself)" },
  { id: "open", keys: "Ctrl O", text: "Open a file from this computer" },
  { id: "add", keys: "A", text: "Add points on click" },
  { id: "select", keys: "Esc", text: "Stop the tool, close what is open" },
  { id: "delete", keys: "Delete", text: "Delete the selected point, or corner of the fence" },
  { id: "fit", keys: "F", text: "Fit the plan into the view" },
  { id: "top", keys: "T", text: "Look from above, north up" },
  { id: "chase", keys: "V", text: "Follow the vehicle" },
  {
    id: "section",
    keys: "1 to 8",
    text: "Open or close that section on the left",
  },
  { id: "view", keys: "G then P or F or R", text: "Go to Plan, Fly or Review, from any view" },
  { id: "vehicle", keys: "G then 1 to 8", text: "Show that vehicle, where there are several" },
  { id: "acknowledge", keys: "K", text: "Acknowledge the alarm on top" },
  { id: "sound", keys: "M", text: "Sound of alarms on or off" },
  { id: "play", keys: "Space", text: "Review: play and pause" },
  { id: "seek", keys: "← or →", text: "Review: 10 s back, 10 s forward" },
  { id: "frame", keys: "← or →", text: "Radar files: one frame back or on, with Shift ten" },
  { id: "help", keys: "?", text: "This sheet" },
  { id: "pages", keys: "H", text: "The pages of Help, in a tab of their own" },
] as const;

export type ShortcutId = (typeof SHORTCUTS)[number]["id"];

export interface Key {
  key: string;
  mod: boolean;
  shift: boolean;
}

export interface Hit {
  id: ShortcutId;
  /** For `section`: which, from 1. */
  section?: number;
  /** For `vehicle`: which, from 1. */
  vehicle?: number;
  /** For `view`: which. */
  view?: ViewId;
  /** For `seek`: by how much. */
  by_s?: number;
  /** For `frame`: by how many. */
  by?: number;
}

/** Where the key was pressed: the view, what Review looks at, and whether G was pressed just before. */
export interface Where {
  view: ViewId;
  study?: StudyId;
  afterG: boolean;
}

/** How long after G its second key may come. */
const SEQUENCE_MS = 1500;

/** Times of key presses count from when their own page was opened, and the 3D view is a page of its own. */
export function pressedAt_ms({ timeStamp, view }: Pick<UIEvent, "timeStamp" | "view">): number {
  return timeStamp + (view ?? window).performance.timeOrigin;
}

export const afterG = (pressedG_ms: number, at_ms: number) => {
  const since_ms = at_ms - pressedG_ms;
  return since_ms >= 0 && since_ms < SEQUENCE_MS;
};

const VIEW_KEYS: Readonly<Record<string, ViewId>> = { p: "plan", f: "fly", r: "review" };
/** What would change the plan has no meaning where it is flown or reviewed. */
const PLANNING: ReadonlySet<ShortcutId> = new Set(["undo", "redo", "add", "delete"]);
const SEEK_S = 10;

/** The shortcut that a key press means. Inside inputs only saving and opening are ours. */
export function shortcutOf(
  pressed: Key,
  inInput: boolean,
  where: Where = { view: "plan", afterG: false },
): Hit | null {
  const isSecond = where.afterG && !pressed.mod && !inInput;
  if (isSecond && /^[1-8]$/.test(pressed.key)) return { id: "vehicle", vehicle: Number(pressed.key) };
  const view = VIEW_KEYS[pressed.key.toLowerCase()];
  if (isSecond && view) return { id: "view", view };
  const hit = where.view === "review" && !pressed.mod && !inInput ? reviewKey(pressed, where.study) : null;
  const found = hit ?? anywhere(pressed, inInput);
  return found && where.view !== "plan" && PLANNING.has(found.id) ? null : found;
}

function reviewKey(pressed: Key, study: StudyId = "flights"): Hit | null {
  if (study === "flights") return replayKey(pressed.key);
  return study === "radar" ? frameKey(pressed) : null;
}

function frameKey({ key, shift }: Key): Hit | null {
  const by = shift ? 10 : 1;
  if (key === "ArrowLeft") return { id: "frame", by: -by };
  return key === "ArrowRight" ? { id: "frame", by } : null;
}

function replayKey(key: string): Hit | null {
  if (key === " ") return { id: "play" };
  if (key === "ArrowLeft") return { id: "seek", by_s: -SEEK_S };
  return key === "ArrowRight" ? { id: "seek", by_s: SEEK_S } : null;
}

function anywhere({ key, mod, shift }: Key, inInput: boolean): Hit | null {
  const lower = key.toLowerCase();
  if (mod) {
    if (lower === "s") return { id: "save" };
    if (lower === "o") return { id: "open" };
    if (inInput) return null;
    if (lower === "z") return { id: shift ? "redo" : "undo" };
    return lower === "y" ? { id: "redo" } : null;
  }
  if (inInput) return null;
  const plain: Record<string, ShortcutId> = {
    a: "add",
    escape: "select",
    delete: "delete",
    f: "fit",
    t: "top",
    v: "chase",
    k: "acknowledge",
    m: "sound",
    h: "pages",
    "?": "help",
  };
  if (/^[1-8]$/.test(key)) return { id: "section", section: Number(key) };
  const id = plain[lower];
  return id ? { id } : null;
}
