import type { HealthRow } from "../messages";
import { health, type Source } from "../store/flying";
import { failed, late_s } from "../store/reach";
import { Icon, type IconName } from "../ui/Icon";

const TITLES: Record<HealthRow["code"], string> = {
  ready: "Vehicle",
  estimator: "Estimator",
  gnss: "GNSS",
  vibration: "Vibration",
  battery: "Battery",
  wind: "Wind",
};

const ICONS: Record<HealthRow["level"], IconName> = {
  good: "check",
  near: "warning",
  bad: "warning",
  unknown: "question",
};

const WORDS: Record<HealthRow["level"], string> = {
  good: "Good",
  near: "Near its limit",
  bad: "Beyond its limit",
  unknown: "Not known",
};

function Row({ row, isPast }: { row: HealthRow; isPast: boolean }) {
  const level = isPast ? "unknown" : row.level;
  return (
    <li class={`health-row ${level}`} data-testid={`health-${row.code}`} data-level={level}>
      <Icon name={ICONS[level]} size={16} />
      <span class="health-title">{TITLES[row.code]}</span>
      <span>
        <span class="visually-hidden">{WORDS[level]}: </span>
        <strong>{row.value}</strong>
        {row.limit && <span class="muted"> {row.limit}</span>}
      </span>
      {row.text && <p>{row.text}</p>}
    </li>
  );
}

/** How the vehicle is, each value beside its limit; always the same rows, so that nothing jumps. */
export function Health({ source }: { source: Source }) {
  const rows = health[source].value;
  if (rows.length === 0) return null;
  const isPast = source === "live" && (failed.value !== null || late_s.value !== null);
  return (
    <section class="instrument health" aria-label="Health" data-testid={`health-list-${source}`}>
      <h2>Health</h2>
      <ul class={isPast ? "old" : ""}>
        {rows.map((row) => (
          <Row key={row.code} row={row} isPast={isPast} />
        ))}
      </ul>
    </section>
  );
}
