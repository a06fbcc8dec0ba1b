/** What this page looks at, as its address tells it: `#plan`, `#review/radar`. */

export const VIEWS = ["plan", "fly", "review"] as const;
export type ViewId = (typeof VIEWS)[number];

/** What Review looks at. */
export const STUDIES = [
  { value: "flights", label: "Flights" },
  { value: "radar", label: "Radar files" },
  { value: "scenarios", label: "Scenarios" },
] as const;

export type StudyId = (typeof STUDIES)[number]["value"];

const parts = (hash: string) => hash.replace(/^#/, "").split("/");

/** From an address such as `#fly`; null where it names none. */
export const viewIn = (hash: string): ViewId | null => VIEWS.find((id) => id === parts(hash)[0]) ?? null;

/** From an address such as `#review/radar`; null where it names none. */
export function studyIn(hash: string): StudyId | null {
  const named = parts(hash)[1];
  return STUDIES.find(({ value }) => value === named)?.value ?? null;
}

export const addressOf = (view: ViewId, study: StudyId) =>
  view === "review" && study !== "flights" ? `#review/${study}` : `#${view}`;
