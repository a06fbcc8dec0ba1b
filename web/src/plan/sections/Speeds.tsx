import { withUnit } from "../../format";
import { LIMITS, type PlanDoc, type ProfileDoc } from "../../messages";
import { Segmented } from "../../ui/Button";
import { NumberField } from "../../ui/NumberField";
import { Section } from "../../ui/Section";
import { editGroup } from "../../store/plan";

const FIELDS = [
  { key: "mean_speed_m_s", label: "Mean speed", unit: "m/s", testid: "mean-speed-input" },
  { key: "max_speed_m_s", label: "Top speed", unit: "m/s", testid: "max-speed-input" },
  { key: "max_climb_m_s", label: "Climb", unit: "m/s", testid: "climb-input" },
  { key: "max_descent_m_s", label: "Descent", unit: "m/s", testid: "descent-input" },
  { key: "max_accel_m_s2", label: "Acceleration", unit: "m/s²", testid: "accel-input" },
] as const satisfies readonly { key: keyof ProfileDoc; label: string; unit: string; testid: string }[];

export function SpeedsSection({ plan: { profile, path } }: { plan: PlanDoc }) {
  return (
    <Section
      id="speeds"
      title="Speeds and path"
      icon="speed"
      summary={withUnit(profile.mean_speed_m_s, "m/s", 1)}
    >
      <div class="field-grid">
        {FIELDS.map(({ key, ...field }) => (
          <NumberField
            key={key}
            {...field}
            {...LIMITS.ProfileDoc[key]}
            step={0.1}
            value={profile[key]}
            onChange={(value) => editGroup("profile", "speeds", field.label, { [key]: value })}
          />
        ))}
        <NumberField
          label="Sampled every"
          unit="m"
          {...LIMITS.PathDoc.step_m}
          step={0.05}
          value={path.step_m}
          testid="step-input"
          onChange={(step_m) => editGroup("path", "speeds", "Sampling", { step_m })}
        />
      </div>
      <div class="labelled">
        <span>Where it is too steep to climb</span>
        <Segmented
          label="Where it is too steep to climb"
          testid="on-steep"
          value={path.on_steep}
          options={[
            {
              value: "raise",
              label: "Raise the path",
              title: "Start climbing earlier: longer above the surface",
            },
            { value: "slow", label: "Fly slower", title: "Stay on the surface and take longer" },
          ]}
          onChange={(on_steep) => editGroup("path", "speeds", "Where it is steep", { on_steep })}
        />
      </div>
    </Section>
  );
}
