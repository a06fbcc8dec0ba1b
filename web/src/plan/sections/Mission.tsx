import { LIMITS, type ClearanceDoc, type MissionDoc, type PlanDoc } from "../../messages";
import { Segmented } from "../../ui/Button";
import { NumberField } from "../../ui/NumberField";
import { Section } from "../../ui/Section";
import { AutoField } from "../../ui/fields";
import { editGroup } from "../../store/plan";
import { terrain } from "../../store/state";
import { Heading } from "./Heading";
import { TradeTable } from "./TradeTable";

const set = (label: string, fields: Partial<MissionDoc>) => editGroup("mission", "mission", label, fields);
const demand = (label: string, fields: Partial<ClearanceDoc>) =>
  editGroup("clearance", "mission", label, fields);

const CAMERA = [
  {
    key: "gimbal_pitch_deg",
    label: "Set the gimbal",
    says: "Gimbal",
    auto: "(left alone)",
    unit: "°",
    ...LIMITS.MissionDoc.gimbal_pitch_deg,
    step: 5,
    testid: "gimbal",
  },
  {
    key: "camera_trigger_m",
    label: "Photo by distance",
    says: "Camera trigger",
    auto: "(none)",
    unit: "m",
    ...LIMITS.MissionDoc.camera_trigger_m,
    step: 0.5,
    testid: "trigger",
  },
] as const;

function Camera({ mission }: { mission: MissionDoc }) {
  return (
    <>
      {CAMERA.map(({ key, says, ...field }) => (
        <AutoField
          key={key}
          {...field}
          value={mission[key]}
          onChange={(value) => set(says, { [key]: value })}
        />
      ))}
    </>
  );
}

function HeightLimit({ clearance }: { clearance: ClearanceDoc }) {
  return (
    <AutoField
      label="Limit height above ground"
      auto="(none)"
      unit="m"
      {...LIMITS.ClearanceDoc.max_height_above_ground_m}
      step={5}
      value={clearance.max_height_above_ground_m}
      testid="max-height"
      onChange={(max_height_above_ground_m) => demand("Height limit", { max_height_above_ground_m })}
    />
  );
}

export function MissionSection({ plan }: { plan: PlanDoc }) {
  const { mission, profile } = plan;
  const datum = terrain.value?.vertical_datum ?? null;
  return (
    <Section
      id="mission"
      title="Mission"
      icon="flag"
      summary={mission.end === "rtl" ? "then return" : "then land"}
    >
      <NumberField
        label="Excess height"
        unit="m"
        {...LIMITS.MissionDoc.excess_height_m}
        step={0.1}
        value={mission.excess_height_m}
        testid="excess-input"
        onChange={(excess_height_m) => set("Excess height", { excess_height_m })}
      />
      <TradeTable
        chosen_m={mission.excess_height_m}
        onChoose={(excess_height_m) => set("Excess height", { excess_height_m })}
      />
      <div class="labelled">
        <span>At the end</span>
        <Segmented
          label="At the end"
          testid="end"
          value={mission.end}
          options={[
            { value: "rtl", label: "Return (RTL)" },
            { value: "land", label: "Land at home" },
          ]}
          onChange={(end) => set("End of the mission", { end })}
        />
      </div>
      <NumberField
        label="Return height above home, as set in the autopilot"
        unit="m"
        {...LIMITS.ProfileDoc.rtl_height_m}
        step={1}
        value={profile.rtl_height_m}
        testid="rtl-height-input"
        onChange={(rtl_height_m) => editGroup("profile", "mission", "Return height", { rtl_height_m })}
      />
      <div class="labelled">
        <span>Altitudes in the files</span>
        <Segmented
          label="Altitudes in the files"
          testid="altitude-reference"
          value={mission.altitude_reference}
          options={[
            { value: "home", label: "Above home" },
            {
              value: "amsl",
              label: "AMSL",
              disabled: datum === null,
              title: datum ? `In ${datum}` : "The terrain's vertical datum is unknown",
            },
          ]}
          onChange={(altitude_reference) => set("Altitude reference", { altitude_reference })}
        />
      </div>
      <Heading mission={mission} />
      <Camera mission={mission} />
      <HeightLimit clearance={plan.clearance} />
    </Section>
  );
}
