import { LIMITS, type PerceptionSettings, type TrackerSettings, type VelocitySettings } from "../messages";
import { setPerception } from "../obstacles/obstacle_orders";
import { whyNotAsk } from "../store/reach";
import { NumberFields, type NumberSpec } from "../ui/NumberField";
import { Check, SelectField } from "../ui/fields";

/** The numbers of settings whose limits are told. */
type Numbers<T, Limits> = {
  [K in keyof T & keyof Limits]: T[K] extends number ? K & string : never;
}[keyof T & keyof Limits];
type Velocity = Numbers<VelocitySettings, typeof LIMITS.VelocitySettingsBody>;
type Tracker = Numbers<TrackerSettings, typeof LIMITS.TrackerSettingsBody>;

const VELOCITIES: readonly NumberSpec<Velocity>[] = [
  { key: "stands_m", label: "Clear of what stands", unit: "m", step: 0.5 },
  { key: "stands_s", label: "Mind it ahead by", unit: "s", step: 1 },
  { key: "max_speed_m_s", label: "Fastest, 0: the vehicle's", unit: "m/s", step: 0.5 },
  { key: "max_turn_deg", label: "Sharpest turn", unit: "°", step: 5 },
  { key: "leave_m_s", label: "Leave what is too near at", unit: "m/s", step: 0.1 },
];

const TRACKER: readonly NumberSpec<Tracker>[] = [
  { key: "range_sigma_m", label: "Range error", unit: "m", step: 0.05 },
  { key: "bearing_sigma_deg", label: "Bearing error", unit: "°", step: 0.5 },
  { key: "bearing_edge_deg", label: "Up to, off the nose", unit: "°", step: 5 },
  { key: "bearing_edge_sigma_deg", label: "Bearing error beyond", unit: "°", step: 0.5 },
  { key: "radial_speed_sigma_m_s", label: "Radial speed error", unit: "m/s", step: 0.05 },
  {
    key: "radial_speed_folded_m_s",
    label: "Speeds fold at, 0: never",
    unit: "m/s",
    step: 0.5,
  },
  { key: "extent_m", label: "Echo wanders by", unit: "m", step: 0.1 },
  { key: "acceleration_m_s2", label: "Objects accelerate by", unit: "m/s²", step: 0.5 },
  { key: "speed_m_s", label: "Usual speed", unit: "m/s", step: 0.5 },
  { key: "gate", label: "Gate, squared sigmas", unit: "", step: 0.5 },
  { key: "birth", label: "Object below", unit: "", step: 0.1 },
  { key: "birth_updates", label: "Seen at least", unit: "times", step: 1, whole: true },
  { key: "death", label: "Forgotten above", unit: "", step: 0.5 },
  { key: "apart_m", label: "Objects are apart by", unit: "m", step: 0.25 },
];

const CHOICES: readonly { value: VelocitySettings["choice"]; label: string }[] = [
  { value: "room", label: "The one with the most room" },
  { value: "edge", label: "The nearest, as in the paper" },
];

const STATES: readonly { value: TrackerSettings["coordinates"]; label: string }[] = [
  { value: "cartesian", label: "Place and velocity over ground" },
  { value: "polar", label: "Range, bearing and their rates" },
];

/** How moving and standing objects are followed, and what velocities past them keep to. */
export function TrackSettings({ settings: { tracker, velocities } }: { settings: PerceptionSettings }) {
  const disabled = whyNotAsk.value !== null;
  return (
    <>
      <h3>Velocities past objects</h3>
      <div class="field-grid">
        <NumberFields
          fields={VELOCITIES}
          limits={LIMITS.VelocitySettingsBody}
          values={velocities}
          disabled={disabled}
          group="velocities"
          onChange={(key, value) => void setPerception({ velocities: { [key]: value } })}
        />
      </div>
      <SelectField
        label="Where it gets tight"
        value={velocities.choice}
        options={CHOICES}
        testid="velocities-choice"
        onChange={(choice) => void setPerception({ velocities: { choice } })}
      />
      <Check
        label="As in the paper: only the nearest object"
        checked={velocities.nearest_only}
        disabled={disabled}
        testid="velocities-nearest-only"
        onChange={(nearest_only) => void setPerception({ velocities: { nearest_only } })}
      />
      <details data-testid="tracker-settings">
        <summary>How objects are followed</summary>
        <SelectField
          label="Filter states"
          value={tracker.coordinates}
          options={STATES}
          testid="tracker-coordinates"
          onChange={(coordinates) => void setPerception({ tracker: { coordinates } })}
        />
        <div class="field-grid">
          <NumberFields
            fields={TRACKER}
            limits={LIMITS.TrackerSettingsBody}
            values={tracker}
            disabled={disabled}
            group="tracker"
            onChange={(key, value) => void setPerception({ tracker: { [key]: value } })}
          />
        </div>
        <p class="hint">Other figures begin afresh: what was followed is found again within a second.</p>
      </details>
    </>
  );
}
