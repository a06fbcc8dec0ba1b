import { count } from "../format";
import { LIMITS, type TrafficSettingsBody } from "../messages";
import { pending, order } from "../store/outcomes";
import { whyNotAsk } from "../store/reach";
import { traffic } from "../store/traffic";
import { NumberFields } from "../ui/NumberField";
import { Done } from "../ui/Outcome";
import { Section } from "../ui/Section";
import { TextField } from "../ui/fields";

const TRAFFIC = "traffic";

const WARN = [
  { key: "warn_distance_m", label: "Nearer than", unit: "m", step: 100 },
  { key: "warn_height_m", label: "Above or below by less than", unit: "m", step: 10 },
  { key: "look_ahead_s", label: "Within the next", unit: "s", step: 5 },
] as const;

const SHOW = [
  { key: "show_distance_m", label: "Not farther than", unit: "m", step: 500 },
  { key: "show_height_m", label: "Above or below by at most", unit: "m", step: 100 },
] as const;

const change = (body: TrafficSettingsBody) =>
  void order({ place: TRAFFIC, method: "PUT", path: "/api/traffic/settings", body, done: "Set." });

/** Of which aircraft the pilot is warned, which are shown, and which number is the vehicle's own. */
export function TrafficSection() {
  const known = traffic.live.value;
  if (!known) return null;
  const { settings, status } = known;
  const disabled = whyNotAsk.value !== null;
  const limits = LIMITS.TrafficSettingsBody;
  const fields = { limits, values: settings, disabled, group: TRAFFIC };
  return (
    <Section
      id={TRAFFIC}
      title="Traffic"
      icon="radar"
      summary={status ? count(status.aircraft.length + status.hidden, "aircraft", "aircraft") : "none heard"}
    >
      <p class="hint">
        Needs a receiver for ADS-B or remote ID on board. Who flies decides: crewed aircraft have the right of
        way.
      </p>
      <h3>Warn of what may come</h3>
      <div class="field-grid">
        <NumberFields {...fields} fields={WARN} onChange={(key, value) => change({ [key]: value })} />
      </div>
      <h3>Show what is</h3>
      <div class="field-grid">
        <NumberFields {...fields} fields={SHOW} onChange={(key, value) => change({ [key]: value })} />
      </div>
      <h3>This vehicle itself</h3>
      <TextField
        label="ICAO address of its transponder"
        value={settings.own_icao}
        placeholder="none, such as 4b1805"
        maxLength={6}
        testid="traffic-own_icao"
        onChange={(own_icao) => change({ own_icao })}
      />
      <TextField
        label="Its remote ID"
        value={settings.own_id}
        placeholder="as it sends it"
        maxLength={24}
        testid="traffic-own_id"
        onChange={(own_id) => change({ own_id })}
      />
      {pending.value.has(TRAFFIC) && <span class="muted">Under way…</span>}
      <Done place={TRAFFIC} />
    </Section>
  );
}
