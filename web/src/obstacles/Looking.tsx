import { signal } from "@preact/signals";
import type { Source } from "../store/flying";
import { hasSensors } from "../store/obstacles";
import { SectionPanel } from "./SectionPanel";
import { TargetsPanel } from "./TargetsPanel";

type Shown = "none" | "section" | "targets";

/** Of both views: who looks at one wants to see it again. */
const shown = signal<Shown>("none");

const CHOICES: readonly { value: Shown; label: string; title: string }[] = [
  { value: "section", label: "Slice", title: "A vertical slice through the maps, at the vehicle" },
  { value: "targets", label: "Radar targets", title: "All targets of the newest radar frame, and its gate" },
];

/** What can be looked at beside the 3D view; asked for only while it is shown. */
export function Looking({ source }: { source: Source }) {
  if (!hasSensors[source].value) return null;
  return (
    <section class="instrument" aria-label="Look closer" data-testid={`looking-${source}`}>
      <div class="segmented" role="group" aria-label="Look closer">
        {CHOICES.map(({ value, label, title }) => (
          <button
            key={value}
            type="button"
            title={title}
            aria-pressed={shown.value === value}
            data-testid={`looking-${value}`}
            onClick={() => (shown.value = shown.value === value ? "none" : value)}
          >
            {label}
          </button>
        ))}
      </div>
      {shown.value === "section" && <SectionPanel source={source} />}
      {shown.value === "targets" && <TargetsPanel source={source} />}
    </section>
  );
}
