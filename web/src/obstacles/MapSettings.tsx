import { useState } from "preact/hooks";
import { LIMITS, type PerceptionSettings, type PerceptionSettingsBody } from "../messages";
import { whyNotAsk } from "../store/reach";
import { setError } from "../store/state";
import { Button } from "../ui/Button";
import { ErrorBox } from "../ui/Outcome";
import { HoldButton } from "../ui/HoldButton";
import { NumberField, NumberFields } from "../ui/NumberField";
import { type AnotherMap, BYTES_PER_MB, beginsAnew, differing } from "./another_map";
import { MAP_SETTINGS, setPerception } from "./obstacle_orders";

const AT_ONCE = [
  { key: "vehicle_radius_m", label: "Vehicle's radius", unit: "m", step: 0.1 },
  { key: "position_error_m", label: "Position error", unit: "m", step: 0.1 },
  { key: "cloud_voxel_m", label: "Camera's points: one per", unit: "m", step: 0.05 },
] as const;

const VOXELS = [
  { key: "radar_resolution_m", label: "Radar's voxels", unit: "m", step: 0.1 },
  { key: "vision_resolution_m", label: "Camera's voxels", unit: "m", step: 0.05 },
] as const;

const MEMORY = LIMITS.PerceptionSettingsBody.memory_limit_bytes;

/** Nothing is asked for before it has been said which maps begin anew, and held for. */
function Anew({ body, giveUp }: { body: PerceptionSettingsBody; giveUp: () => void }) {
  const words = beginsAnew(body);
  if (!words) return null;
  const ask = async () => {
    if (await setPerception(body, MAP_SETTINGS)) giveUp();
  };
  return (
    <div class="callout wrap-row" data-testid="begins-anew">
      <p>{words}</p>
      <div class="row wrap minor-actions">
        <HoldButton
          label="Begin anew"
          icon="check"
          place={MAP_SETTINGS}
          disabled={whyNotAsk.value !== null}
          testid="begin-anew"
          onHold={() => void ask()}
        />
        <Button kind="quiet" testid="keep-maps" onClick={giveUp}>
          Keep
        </Button>
      </div>
    </div>
  );
}

/** The vehicle that obstacles are kept from, and the maps' voxels and memory. */
export function MapSettings({ settings }: { settings: PerceptionSettings }) {
  const [wanted, setWanted] = useState<AnotherMap>({});
  const disabled = whyNotAsk.value !== null;
  const memory_bytes = wanted.memory_limit_bytes ?? settings.memory_limit_bytes;
  const want = (more: AnotherMap) => setWanted({ ...wanted, ...more });
  const giveUp = () => {
    setWanted({});
    setError(MAP_SETTINGS, null);
  };
  return (
    <details class="details" data-testid="map-settings">
      <summary>Vehicle and maps</summary>
      <div class="field-grid">
        <NumberFields
          fields={AT_ONCE}
          limits={LIMITS.PerceptionSettingsBody}
          values={settings}
          disabled={disabled}
          group="perception"
          onChange={(key, value) => void setPerception({ [key]: value }, MAP_SETTINGS)}
        />
        <NumberFields
          fields={VOXELS}
          limits={LIMITS.PerceptionSettingsBody}
          values={{ ...settings, ...wanted }}
          disabled={disabled}
          group="perception"
          onChange={(key, value) => want({ [key]: value })}
        />
        <NumberField
          label="Memory per map"
          unit="MB"
          min={MEMORY.min / BYTES_PER_MB}
          max={MEMORY.max / BYTES_PER_MB}
          step={100}
          value={memory_bytes / BYTES_PER_MB}
          disabled={disabled}
          testid="perception-memory_mb"
          onChange={(mb) => want({ memory_limit_bytes: Math.round(mb * BYTES_PER_MB) })}
        />
      </div>
      <p class="hint">
        Other voxels, or another memory, begin a map anew. The range finder's map has the camera's voxels. A
        full map takes little or nothing new, and says so. Camera's points: 0 m uses all of them.
      </p>
      <ErrorBox place={MAP_SETTINGS} />
      <Anew body={differing(wanted, settings)} giveUp={giveUp} />
    </details>
  );
}
