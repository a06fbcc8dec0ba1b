import { demanded } from "../../format";
import { LIMITS, type BudgetDoc, type ClearanceDoc, type PlanDoc, type ProfileDoc } from "../../messages";
import { editGroup } from "../../store/plan";
import { isFresh, result } from "../../store/state";
import { Segmented } from "../../ui/Button";
import { Icon } from "../../ui/Icon";
import { NumberField } from "../../ui/NumberField";
import { Section } from "../../ui/Section";
import { AutoField } from "../../ui/fields";

const set = (label: string, fields: Partial<ProfileDoc>) => editGroup("profile", "required", label, fields);
const demand = (label: string, fields: Partial<ClearanceDoc>) =>
  editGroup("clearance", "required", label, fields);

const first = (text: string) => text.charAt(0).toUpperCase() + text.slice(1);

/** Every term, rounded up, with where it comes from, their sum, and what a smaller clearance leaves out. */
function Terms({ budget, isOld }: { budget: BudgetDoc; isOld: boolean }) {
  return (
    <div class={`terms ${isOld ? "stale" : ""}`} data-testid="clearance-terms">
      <dl>
        {budget.terms.map((term) => (
          <div key={term.code} data-term={term.code}>
            <dt>{first(term.name)}</dt>
            <dd>{demanded(term.value_m)}</dd>
            <dd class="source">{term.source}</dd>
          </div>
        ))}
        <div class="sum">
          <dt>Sum</dt>
          <dd data-testid="clearance-sum">{demanded(budget.total_m)}</dd>
          <dd class="source">{budget.rule}</dd>
        </div>
      </dl>
      {budget.uncovered.length > 0 && (
        <p class="uncovered" data-testid="clearance-uncovered" role="status">
          <Icon name="warning" size={16} />
          <span>
            Not covered:{" "}
            {budget.uncovered.map((part) => `${demanded(part.missing_m)} of ${part.name}`).join(", ")}
          </span>
        </p>
      )}
    </div>
  );
}

function Downwash({ profile }: { profile: ProfileDoc }) {
  return (
    <>
      <div class="field-grid">
        <NumberField
          label="Take-off mass"
          unit="kg"
          {...LIMITS.ProfileDoc.mass_kg}
          step={0.1}
          value={profile.mass_kg}
          testid="mass-input"
          onChange={(mass_kg) => set("Mass", { mass_kg })}
        />
        <NumberField
          label="Rotors"
          unit=""
          {...LIMITS.ProfileDoc.rotors}
          step={1}
          whole
          value={profile.rotors}
          testid="rotors-input"
          onChange={(rotors) => set("Rotors", { rotors })}
        />
        <NumberField
          label="Rotor diameter"
          unit="m"
          {...LIMITS.ProfileDoc.rotor_diameter_m}
          step={0.01}
          value={profile.rotor_diameter_m}
          testid="rotor-diameter-input"
          onChange={(rotor_diameter_m) => set("Rotor diameter", { rotor_diameter_m })}
        />
      </div>
      <AutoField
        label="Own downwash"
        auto="(by mass and rotors)"
        unit="m"
        {...LIMITS.ProfileDoc.downwash_m}
        step={0.1}
        value={profile.downwash_m}
        testid="downwash"
        onChange={(downwash_m) => set("Downwash", { downwash_m })}
      />
    </>
  );
}

/** What the required clearance is made of, and each part of it that is not set under Vehicle. */
export function RequiredSection({ plan: { clearance, profile } }: { plan: PlanDoc }) {
  const budget = result.value?.clearance_budget ?? null;
  const required_m = clearance.required_clearance_m ?? budget?.total_m ?? null;
  return (
    <Section
      id="required"
      title="Required clearance"
      icon="shield"
      summary={required_m === null ? "" : demanded(required_m)}
    >
      {budget ? (
        <Terms budget={budget} isOld={!isFresh.value} />
      ) : (
        <p class="hint">
          Its terms appear here with the first plan. Position error and radius: under Vehicle.
        </p>
      )}
      <div class="labelled">
        <span>Flown as</span>
        <Segmented
          label="Flown as"
          testid="flown-as"
          value={clearance.way}
          options={[
            { value: "auto", label: "AUTO", title: "The mission on board" },
            { value: "guided", label: "GUIDED", title: "Waypoints handed over one at a time" },
          ]}
          onChange={(way) => demand("Way of flying", { way })}
        />
      </div>
      <AutoField
        label="Own following error"
        auto="(as measured)"
        unit="m"
        {...LIMITS.ProfileDoc.following_m}
        step={0.1}
        value={profile.following_m}
        testid="following"
        onChange={(following_m) => set("Following error", { following_m })}
      />
      <NumberField
        label="RMS error of the surface model"
        unit="m"
        {...LIMITS.ProfileDoc.dsm_rms_m}
        step={0.01}
        value={profile.dsm_rms_m}
        testid="dsm-rms-input"
        onChange={(dsm_rms_m) => set("Accuracy of the surface model", { dsm_rms_m })}
      />
      <Downwash profile={profile} />
      <AutoField
        label="Own required clearance"
        auto={budget ? `(${demanded(budget.total_m)})` : ""}
        unit="m"
        {...LIMITS.ClearanceDoc.required_clearance_m}
        step={0.1}
        value={clearance.required_clearance_m}
        initial={Number((budget?.total_m ?? 5).toFixed(2))}
        testid="required-clearance"
        onChange={(required_clearance_m) => demand("Required clearance", { required_clearance_m })}
      />
    </Section>
  );
}
