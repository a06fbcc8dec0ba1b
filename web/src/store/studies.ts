import { computed, signal } from "@preact/signals";
import type { RadarFileDoc, RadarFrame, RadarOpened, RadarReading } from "../messages";

/** Files of raw samples that the station keeps; null: not told yet. */
export const radarFiles = signal<readonly RadarFileDoc[] | null>(null);
/** The one that this page looks at, and how it is to be read. */
export const chosenId = signal<string | null>(null);
export const reading = signal<RadarReading>({});
/** What the file came to, and the frame that is shown; null while that is being found out. */
export const opened = signal<RadarOpened | null>(null);
export const shownFrame = signal<RadarFrame | null>(null);
/** The frame that is wanted: the slider's place, which the picture follows. */
export const wantedFrame = signal(0);
/** The detection that is pointed at, in picture or table. */
export const marked = signal<number | null>(null);

export const chosen = computed(() => radarFiles.value?.find((file) => file.id === chosenId.value) ?? null);
