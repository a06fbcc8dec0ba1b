import { metres } from "../format";
import { LIMITS, type PerceptionSettings, type PerceptionSettingsBody } from "../messages";
import { hasSensors, obstacles } from "../store/obstacles";
import { pending } from "../store/outcomes";
import { whyNotAsk } from "../store/reach";
import { Done } from "../ui/Outcome";
import { HoldButton } from "../ui/HoldButton";
import { NumberFields, type NumberSpec } from "../ui/NumberField";
import { Section } from "../ui/Section";
import { Check, SelectField } from "../ui/fields";
import { TrackSettings } from "../tracks/TrackSettings";
import { MapExports } from "../obstacles/MapExports";
import { MapSettings } from "../obstacles/MapSettings";
import { MAPS, clearMaps, setPerception } from "../obstacles/obstacle_orders";

const FIELDS = [
  { key: "radar_depth_m", label: "Radar looks ahead", unit: "m", step: 1 },
  { key: "vision_depth_m", label: "Camera looks ahead", unit: "m", step: 1 },
  { key: "ranges_depth_m", label: "Range finder looks ahead", unit: "m", step: 1 },
  { key: "fov_deg", label: "Width of the region", unit: "°", step: 2 },
  { key: "height_m", label: "Height of the region", unit: "m", step: 0.5 },
  { key: "safety_radius_m", label: "Clear of what moves", unit: "m", step: 0.5 },
  { key: "approach_s", label: "Warn of it ahead by", unit: "s", step: 1 },
] as const;

const GATE = [
  { key: "radar_azimuth_deg", label: "To both sides", unit: "°", step: 5 },
  { key: "radar_low_deg", label: "From elevation", unit: "°", step: 1 },
  { key: "radar_high_deg", label: "Up to elevation", unit: "°", step: 1 },
] as const;

const CLIMB = [
  { key: "climb_m_s", label: "Climbs at", unit: "m/s", step: 0.1 },
  { key: "climb_ceiling_m", label: "At most above plan", unit: "m", step: 1 },
] as const;

const VARIANTS: readonly { value: PerceptionSettings["radar_variant"]; label: string }[] = [
  { value: "heading_only", label: "Heading only, at own height" },
  { value: "full_attitude", label: "Attitude and measured elevation" },
  { value: "full_attitude_flat", label: "Attitude, at own height" },
];

const change = (body: PerceptionSettingsBody) => void setPerception(body);

type Key = (typeof FIELDS | typeof GATE | typeof CLIMB)[number]["key"];

interface FieldsProps {
  fields: readonly NumberSpec<Key>[];
  settings: PerceptionSettings;
}

function Fields({ fields, settings }: FieldsProps) {
  return (
    <div class="field-grid">
      <NumberFields
        fields={fields}
        limits={LIMITS.PerceptionSettingsBody}
        values={settings}
        disabled={whyNotAsk.value !== null}
        group="perception"
        onChange={(key, value) => change({ [key]: value })}
      />
    </div>
  );
}

/** What is searched ahead, and how radar targets are placed. */
function Searched({ settings }: { settings: PerceptionSettings }) {
  const disabled = whyNotAsk.value !== null;
  return (
    <>
      <Fields fields={FIELDS} settings={settings} />
      <h3>Over what stands in the way</h3>
      <Fields fields={CLIMB} settings={settings} />
      <h3>Radar targets that are used</h3>
      <Fields fields={GATE} settings={settings} />
      <SelectField
        label="Radar targets"
        value={settings.radar_variant}
        options={VARIANTS}
        testid="radar-variant"
        onChange={(radar_variant) => change({ radar_variant })}
      />
      <Check
        label="As in the papers: no known ground, no corridor along the mission"
        checked={settings.paper_bare}
        disabled={disabled}
        testid="paper-bare"
        onChange={(paper_bare) => change({ paper_bare })}
      />
      {settings.paper_bare && (
        <p class="hint">
          Flying near the ground, the ground itself will alarm: it is not told from obstacles.
        </p>
      )}
    </>
  );
}

function Clear() {
  return (
    <HoldButton
      label="Empty the maps"
      icon="trash"
      place={MAPS}
      disabled={whyNotAsk.value !== null}
      title="Everything seen so far is forgotten; recordings keep it"
      testid="clear-maps"
      onHold={() => void clearMaps()}
    />
  );
}

/** What the sensors search, and their maps: how fine and large, as files, or begun anew. */
export function ObstaclesSection() {
  const { settings } = obstacles.live.value;
  const there = hasSensors.live.value;
  const summary = there
    ? `${metres(settings.radar_depth_m, 0)} radar, ${metres(settings.vision_depth_m, 0)} camera`
    : "no sensor yet";
  return (
    <Section id={MAPS} title="Obstacles" icon="radar" summary={summary}>
      <Searched settings={settings} />
      <TrackSettings settings={settings} />
      <MapSettings settings={settings} />
      <h3>Maps as files</h3>
      <MapExports source="live" />
      <div class="row wrap minor-actions">
        <Clear />
        {pending.value.has(MAPS) && <span class="muted">Under way…</span>}
      </div>
      <Done place={MAPS} />
    </Section>
  );
}
