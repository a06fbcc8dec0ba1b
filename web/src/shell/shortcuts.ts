/** The keys of the console, in the order of the help sheet. `mod` is Ctrl, or Cmd on a Mac. */
export const SHORTCUTS = [
  { id: "undo", keys: "Ctrl Z", text: "Undo" },
  { id: "redo", keys: "Ctrl Shift Z or Ctrl Y", text: "Redo" },
  { id: "save", keys: "Ctrl S", text: "Save under a new name (the plan saves itself)" },
  { id: "open", keys: "Ctrl O", text: "Open a file from this computer" },
  { id: "add", keys: "A", text: "Add points on click" },
  { id: "select", keys: "Esc", text: "Stop the tool, close what is open" },
  { id: "delete", keys: "Delete", text: "Delete the selected point" },
  { id: "fit", keys: "F", text: "Fit the plan into the view" },
  { id: "top", keys: "T", text: "Look from above, north up" },
  { id: "section", keys: "1 to 6", text: "Open or close a section on the left" },
  { id: "help", keys: "?", text: "This sheet" },
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
}

/** The shortcut that a key press means. Inside inputs only saving and opening are ours. */
export function shortcutOf({ key, mod, shift }: Key, inInput: boolean): Hit | null {
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
    "?": "help",
  };
  if (/^[1-6]$/.test(key)) return { id: "section", section: Number(key) };
  const id = plain[lower];
  return id ? { id } : null;
}
