import { signal } from "@preact/signals";

/** What Review looks at. */
export const STUDIES = [
  { value: "flights", label: "Flights" },
  { value: "radar", label: "Radar files" },
  { value: "scenarios", label: "Scenarios" },
] as const;

export type StudyId = (typeof STUDIES)[number]["value"];

/** From an address such as `#review/radar`; null where it names none. */
export function studyIn(hash: string): StudyId | null {
  const named = hash.replace(/^#/, "").split("/")[1];
  return STUDIES.find(({ value }) => value === named)?.value ?? null;
}

export const study = signal<StudyId>(studyIn(globalThis.location?.hash ?? "") ?? "flights");
