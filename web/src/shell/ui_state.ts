import { signal } from "@preact/signals";

/** Which passing parts of the page are open. */
export const openDialog = signal<"help" | "plans" | "save_as" | null>(null);
/** On narrow screens the side panels are drawers: at most one is open. */
export const drawer = signal<"left" | "right" | null>(null);
/** A file is being dragged over the page. */
export const dragging = signal(false);
