import { duration } from "../../format";
import { LIMITS, type PlanDoc, type ProfileDoc } from "../../messages";
import { Button, Segmented } from "../../ui/Button";
import { NumberField } from "../../ui/NumberField";
import { Section } from "../../ui/Section";
import { TextField } from "../../ui/fields";
import { edit, editGroup } from "../../store/plan";
import { library } from "../../store/state";
import { openChecklist } from "../../vehicle/open_checklist";

const { endurance_s: ENDURANCE, reserve_share: RESERVE } = LIMITS.ProfileDoc;

const set = (label: string, fields: Partial<ProfileDoc>) => editGroup("profile", "vehicle", label, fields);

const same = (a: ProfileDoc, b: ProfileDoc) => JSON.stringify(a) === JSON.stringify(b);

function Picker({ profile }: { profile: ProfileDoc }) {
  const { profiles } = library.value;
  const current = profiles.find((entry) => same(entry.profile, profile));
  const pick = (id: string) => {
    const chosen = profiles.find((entry) => entry.id === id)?.profile;
    if (chosen) edit(`Vehicle ${chosen.name}`, "vehicle", (doc) => ({ ...doc, profile: chosen }));
  };
  return (
    <label class="field wide">
      <span>Profile</span>
      <select
        data-testid="profile-select"
        value={current?.id ?? ""}
        onChange={(event) => pick(event.currentTarget.value)}
      >
        {!current && <option value="">{profile.name} (changed)</option>}
        {profiles.map((entry) => (
          <option key={entry.id} value={entry.id}>
            {entry.profile.name}
          </option>
        ))}
      </select>
    </label>
  );
}

export function VehicleSection({ plan: { profile } }: { plan: PlanDoc }) {
  return (
    <Section id="vehicle" title="Vehicle" icon="drone" summary={profile.name}>
      <Picker profile={profile} />
      <TextField
        label="Name"
        value={profile.name}
        onChange={(name) => name && set("Rename vehicle", { name })}
      />
      <Segmented
        label="Autopilot"
        testid="firmware"
        value={profile.firmware}
        options={[
          { value: "ardupilot", label: "ArduPilot" },
          { value: "px4", label: "PX4" },
        ]}
        onChange={(firmware) => set("Autopilot", { firmware })}
      />
      <div class="field-grid">
        <NumberField
          label="Vehicle radius"
          unit="m"
          {...LIMITS.ProfileDoc.radius_m}
          step={0.05}
          value={profile.radius_m}
          testid="vehicle-radius-input"
          onChange={(radius_m) => set("Vehicle radius", { radius_m })}
        />
        <NumberField
          label="Position error"
          unit="m"
          {...LIMITS.ProfileDoc.position_error_m}
          step={0.1}
          value={profile.position_error_m}
          testid="position-error-input"
          onChange={(position_error_m) => set("Position error", { position_error_m })}
        />
        <NumberField
          label="Endurance"
          unit="min"
          min={ENDURANCE.min / 60}
          max={ENDURANCE.max / 60}
          step={1}
          value={profile.endurance_s / 60}
          testid="endurance-input"
          onChange={(minutes) => set("Endurance", { endurance_s: minutes * 60 })}
        />
        <NumberField
          label="Reserve"
          unit="%"
          min={RESERVE.min * 100}
          max={RESERVE.max * 100}
          step={5}
          value={profile.reserve_share * 100}
          testid="reserve-input"
          onChange={(percent) => set("Reserve", { reserve_share: percent / 100 })}
        />
        <NumberField
          label="Mission items"
          unit="at most"
          {...LIMITS.ProfileDoc.max_items}
          step={10}
          whole
          value={profile.max_items}
          testid="max-items-input"
          onChange={(max_items) => set("Most mission items", { max_items })}
        />
        <NumberField
          label="Corner jerk"
          unit="m/s³"
          {...LIMITS.ProfileDoc.max_jerk_m_s3}
          step={0.1}
          value={profile.max_jerk_m_s3}
          testid="jerk-input"
          onChange={(max_jerk_m_s3) => set("Corner jerk", { max_jerk_m_s3 })}
        />
        <NumberField
          label="Braking jerk"
          unit="m/s³"
          {...LIMITS.ProfileDoc.brake_jerk_m_s3}
          step={0.5}
          value={profile.brake_jerk_m_s3}
          testid="brake-jerk-input"
          onChange={(brake_jerk_m_s3) => set("Braking jerk", { brake_jerk_m_s3 })}
        />
      </div>
      <Button icon="check" testid="checklist-edit" onClick={() => openChecklist(profile.name)}>
        Checklist before the start…
      </Button>
      <p class="hint">
        Usable: {duration(profile.endurance_s * (1 - profile.reserve_share))} of{" "}
        {duration(profile.endurance_s)}. Position error: 2.5 m standalone GNSS, 0.1 m RTK.
      </p>
    </Section>
  );
}
