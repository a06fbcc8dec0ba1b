import { effect, signal, type Signal } from "@preact/signals";

/** A setting of this browser, kept in its local storage. A storage that is full or forbidden is no error: the
 * setting then lasts as long as the page. */
function remembered<T>(key: string, initial: T, isValid: (value: unknown) => value is T): Signal<T> {
  const name = `hedgehop.${key}`;
  const setting = signal(read(name, initial, isValid));
  effect(() => {
    try {
      localStorage.setItem(name, JSON.stringify(setting.value));
    } catch {
      return;
    }
  });
  return setting;
}

function read<T>(name: string, initial: T, isValid: (value: unknown) => value is T): T {
  try {
    const value: unknown = JSON.parse(localStorage.getItem(name) ?? "null");
    return isValid(value) ? value : initial;
  } catch {
    return initial;
  }
}

export type Theme = "dark" | "light";

const isTheme = (value: unknown): value is Theme => value === "dark" || value === "light";
const isHeight = (value: unknown): value is number =>
  typeof value === "number" && value >= 120 && value <= 900;
const isOpenMap = (value: unknown): value is Record<string, boolean> =>
  typeof value === "object" && value !== null && !Array.isArray(value);

const isYesNo = (value: unknown): value is boolean => typeof value === "boolean";
const isRange = (value: unknown): value is number => typeof value === "number" && value >= 10 && value <= 120;
const isDisplay = (value: unknown): value is "obstacles" | "velocity" =>
  value === "obstacles" || value === "velocity";
const isText = (value: unknown): value is string => typeof value === "string" && value.length < 40;

export const theme = remembered<Theme>("theme", "dark", isTheme);
export const chartHeight_px = remembered<number>("chartHeight", 244, isHeight);
export const openSections = remembered<Record<string, boolean>>("sections", {}, isOpenMap);
/** The view that was open last. */
export const lastView = remembered<string>("view", "plan", isText);
/** Alerts sound on this computer. */
export const sound = remembered<boolean>("sound", true, isYesNo);
/** Which of the two displays stands at their common place. */
export const aroundDisplay = remembered<"obstacles" | "velocity">("display", "obstacles", isDisplay);
/** What the rim of the polar display stands for. */
export const polarRange_m = remembered<number>("polarRange", 20, isRange);

effect(() => {
  document.documentElement.dataset["theme"] = theme.value;
});
