import { number, withUnit } from "../format";
import type { VehicleState } from "../messages";
import { Icon, type IconName } from "../ui/Icon";
import { batteryLevel, batteryWord, fixLevel, fixWord, type Level } from "./vehicle_words";

interface LineProps {
  icon: IconName;
  label: string;
  value: string;
  note: string;
  level: Level;
  isOld: boolean;
  age: string;
  testid: string;
}

function Line({ icon, label, value, note, level, isOld, age, testid }: LineProps) {
  return (
    <div class={`supply ${level} ${isOld ? "old" : ""}`} data-testid={testid} data-level={level}>
      <Icon name={level === "neutral" ? icon : "warning"} />
      <div>
        <p>
          <span class="visually-hidden">{label}: </span>
          <strong>{value}</strong>
          {age && <span class="age">{age}</span>}
        </p>
        <p class="muted">{note}</p>
      </div>
    </div>
  );
}

function batteryNote(state: VehicleState | null): string {
  const { battery_v = null, battery_a = null, battery_used_mah = null } = state ?? {};
  const parts = [withUnit(battery_v, "V", 1), withUnit(battery_a, "A", 1)];
  if (battery_used_mah !== null) parts.push(`${withUnit(battery_used_mah, "mAh")} used`);
  return parts.join(" · ");
}

function gnssNote(state: VehicleState | null): string {
  if (!state) return "";
  if (state.horizontal_accuracy_m === null) {
    return state.hdop === null ? "accuracy not told" : `HDOP ${number(state.hdop, 1)}`;
  }
  const { horizontal_accuracy_m, vertical_accuracy_m } = state;
  const upright = vertical_accuracy_m === null ? "" : `, ${withUnit(vertical_accuracy_m, "m", 2)} in height`;
  return `±${withUnit(horizontal_accuracy_m, "m", 2)}${upright}`;
}

interface Props {
  state: VehicleState | null;
  battery: { isOld: boolean; age: string };
  gnss: { isOld: boolean; age: string };
}

/** What the flight lives on: battery and satellites. */
export function Supplies({ state, battery, gnss }: Props) {
  const satellites = state?.satellites;
  return (
    <section class="instrument supplies" aria-label="Battery and GNSS">
      <Line
        icon="battery"
        label="Battery"
        value={batteryWord(state)}
        note={batteryNote(state)}
        level={batteryLevel(state)}
        testid="battery"
        {...battery}
      />
      <Line
        icon="satellite"
        label="GNSS"
        value={`${fixWord(state)}${satellites == null ? "" : ` · ${satellites} satellites`}`}
        note={gnssNote(state)}
        level={fixLevel(state)}
        testid="gnss"
        {...gnss}
      />
    </section>
  );
}
