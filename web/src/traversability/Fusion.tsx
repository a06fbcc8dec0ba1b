import { AutoField, SelectField } from "../ui/fields";
import { uwbRule } from "./ground_orders";

const RULES: readonly { value: "explained" | "paper"; label: string }[] = [
  { value: "explained", label: "Echoes are explained" },
  { value: "paper", label: "As in the paper" },
];

const NUMBERS = [
  { key: "p_o", label: "An echo says at most", unit: "", min: 0.51, max: 0.99, step: 0.05, usual: 0.8 },
  { key: "p_c2", label: "Free: 1 less at most", unit: "", min: 0.01, max: 0.49, step: 0.05, usual: 0.2 },
  { key: "p_c3", label: "Free behind an echo", unit: "", min: 0.01, max: 0.49, step: 0.05, usual: 0.3 },
  { key: "c_th", label: "Clutter's headroom", unit: "", min: 0.5, max: 100, step: 0.5, usual: 3 },
  { key: "nearest_m", label: "Scans count from", unit: "m", min: 0.5, max: 50, step: 0.5, usual: 3.5 },
  { key: "farthest_m", label: "Up to", unit: "m", min: 1, max: 100, step: 0.5, usual: 10 },
  { key: "prior", label: "Obstacle beforehand", unit: "", min: 0.51, max: 0.99, step: 0.05, usual: 0.9 },
] as const;

/** How the next radar log is fused with the map: which rule, and with which numbers. */
export function Fusion() {
  const rule = uwbRule.value;
  return (
    <details data-testid="uwb-fusion">
      <summary>Fusion of the next log</summary>
      <SelectField
        label="Fusion"
        value={rule.rule ?? "explained"}
        options={RULES}
        testid="uwb-rule"
        onChange={(value) => (uwbRule.value = { ...rule, rule: value })}
      />
      {NUMBERS.map(({ key, usual, ...field }) => (
        <AutoField
          key={key}
          {...field}
          auto={`${usual}`}
          initial={usual}
          value={rule[key] ?? null}
          testid={`uwb-${key}`}
          onChange={(value) => (uwbRule.value = { ...rule, [key]: value })}
        />
      ))}
    </details>
  );
}
