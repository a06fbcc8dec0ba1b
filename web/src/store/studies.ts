import { computed, signal } from "@preact/signals";
import type {
  RadarFileDoc,
  RadarFrame,
  RadarOpened,
  RadarReading,
  RadarTracksBody,
  RadarTracksDoc,
  ScenarioDoc,
  ScenarioResultDoc,
  ScenarioRunDoc,
} from "../messages";

/** What Review looks at beside flights: files of raw radar samples, and scenarios. */

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

/** What of the chosen file is looked at: its frames, or what was followed against truth. */
export const looksAt = signal<"frames" | "tracks">("frames");
/** Where the poles stood, and how the two files belong together. */
export const NOT_ASKED: RadarTracksBody = { poles: [], offset_s: 0, forward: "x" };
export const askedTracks = signal<RadarTracksBody>(NOT_ASKED);
/** What the last following of the chosen file came to. */
export const shownTracks = signal<RadarTracksDoc | null>(null);

export const chosen = computed(() => radarFiles.value?.find((file) => file.id === chosenId.value) ?? null);

/** What can be run; null: not asked yet. */
export const scenarios = signal<readonly ScenarioDoc[] | null>(null);
/** The one that runs, and those that were run, newest first. */
export const runs = signal<readonly ScenarioRunDoc[]>([]);
/** The scenario that this page looks at, and the result that is open. */
export const chosenName = signal<string | null>(null);
export const shownResult = signal<ScenarioResultDoc | null>(null);

export const running = computed(() => runs.value.find((run) => run.state === "running") ?? null);
export const chosenScenario = computed(
  () => scenarios.value?.find((one) => one.name === chosenName.value) ?? null,
);
