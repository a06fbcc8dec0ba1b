import { latLon } from "../../format";
import { LIMITS, type MissionDoc } from "../../messages";
import { Button, Segmented } from "../../ui/Button";
import { NumberField } from "../../ui/NumberField";
import { drawer } from "../../store/view";
import { editGroup } from "../../store/plan";
import { selection } from "../../store/state";
import { setSelection } from "../../store/stream";

/** On narrow screens the drawer would cover what is to be clicked. */
function pickPlace(): void {
  setSelection({ tool: "look_at" });
  drawer.value = null;
}

const set = (label: string, fields: Partial<MissionDoc>) => editGroup("mission", "mission", label, fields);

function choose(heading: MissionDoc["heading"], mission: MissionDoc): void {
  set("Heading", { heading });
  if (heading === "point" && !mission.look_at) pickPlace();
}

/** Where the nose points: along the path, one way, or at a place. */
export function Heading({ mission }: { mission: MissionDoc }) {
  return (
    <>
      <div class="labelled">
        <span>Nose points</span>
        <Segmented
          label="Nose points"
          testid="heading"
          value={mission.heading}
          options={[
            { value: "path", label: "Along path" },
            { value: "fixed", label: "One way" },
            { value: "point", label: "At a place" },
          ]}
          onChange={(heading) => choose(heading, mission)}
        />
      </div>
      {mission.heading === "fixed" && (
        <NumberField
          label="Heading, clockwise from north"
          unit="°"
          {...LIMITS.MissionDoc.heading_deg}
          step={5}
          value={mission.heading_deg}
          testid="heading-input"
          onChange={(heading_deg) => set("Heading", { heading_deg })}
        />
      )}
      {mission.heading === "point" && (
        <div class="row">
          <span class="place">{mission.look_at ? latLon(mission.look_at) : "No place yet"}</span>
          <Button
            icon="target"
            testid="tool-look_at"
            pressed={selection.value.tool === "look_at"}
            onClick={pickPlace}
          >
            Pick it
          </Button>
        </div>
      )}
    </>
  );
}
