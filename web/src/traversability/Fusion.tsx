import { LIMITS } from "../messages";
import { AutoField, SelectField } from "../ui/fields";
import { uwbRule } from "./ground_orders";

const RULES: readonly { value: "explained" | "paper"; label: string }[] = [
  { value: "explained", label: "Echoes are explained" },
  { value: "paper", label: "As in the paper" },
];

const NUMBERS = [
  { key: "p_o", label: "An echo says at most", unit: "", step: 0.05 },
  { key: "p_c2", label: "Free: 1 less at most", unit: "", step: 0.05 },
  { key: "p_c3", label: "Free behind an echo", unit: "", step: 0.05 },
  { key: "c_th", label: "Clutter's headroom", unit: "", step: 0.5 },
  { key: "nearest_m", label: "Scans count from", unit: "m", step: 0.5 },
  { key: "farthest_m", label: "Up to", unit: "m", step: 0.5 },
  { key: "prior", label: "Obstacle beforehand", unit: "", step: 0.05 },
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
      {NUMBERS.map(({ key, ...field }) => (
        <AutoField
          key={key}
          {...field}
          {...LIMITS.UwbRule[key]}
          auto={`${LIMITS.UwbRule[key].initial}`}
          value={rule[key] ?? null}
          testid={`uwb-${key}`}
          onChange={(value) => (uwbRule.value = { ...rule, [key]: value })}
        />
      ))}
    </details>
  );
}
