import type { ComponentType } from "preact";
import { RadarCentre } from "../studies/RadarCentre";
import { RadarLeft } from "../studies/RadarLeft";
import { RadarRight } from "../studies/RadarRight";
import { ScenarioCentre } from "../studies/ScenarioCentre";
import { ScenarioLeft } from "../studies/ScenarioLeft";
import { ScenarioRight } from "../studies/ScenarioRight";
import { STUDIES, type StudyId } from "../store/address";
import { study } from "../store/view";
import { Segmented } from "../ui/Button";

interface Study {
  Left: ComponentType;
  /** Over the 3D view and what is below it. */
  Centre: ComponentType;
  Right: ComponentType;
}

/** What Review looks at beside flights. */
const OTHERS: Readonly<Record<Exclude<StudyId, "flights">, Study>> = {
  radar: { Left: RadarLeft, Centre: RadarCentre, Right: RadarRight },
  scenarios: { Left: ScenarioLeft, Centre: ScenarioCentre, Right: ScenarioRight },
};

const shown = (): Study | null => (study.value === "flights" ? null : OTHERS[study.value]);

export function StudyTabs() {
  return (
    <div class="study-tabs">
      <Segmented
        label="What to look at"
        testid="study"
        value={study.value}
        options={STUDIES}
        onChange={(next) => (study.value = next)}
      />
    </div>
  );
}

export const StudyLeft = ({ flights: Flights }: { flights: ComponentType }) => {
  const Left = shown()?.Left ?? Flights;
  return (
    <>
      <StudyTabs />
      <Left />
    </>
  );
};

export const StudyRight = ({ flights: Flights }: { flights: ComponentType }) => {
  const Right = shown()?.Right ?? Flights;
  return <Right />;
};

/** Lies over the 3D view, whose alerts stay on top. */
export function StudyCentre() {
  const Centre = shown()?.Centre;
  if (!Centre) return null;
  return (
    <section class="study" aria-label={STUDIES.find(({ value }) => value === study.value)?.label}>
      <Centre />
    </section>
  );
}
