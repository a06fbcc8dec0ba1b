import { useId, useState } from "preact/hooks";
import { editable, parseNumber } from "../format";

export interface NumberRange {
  min: number;
  max: number;
  step: number;
  /** Whole numbers only. */
  whole?: boolean;
}

interface Props extends NumberRange {
  label: string;
  unit: string;
  value: number;
  disabled?: boolean;
  /** The label is read out but not shown. */
  bare?: boolean;
  testid?: string;
  onChange: (value: number) => void;
}

/** The value that a text stands for, or words about what is wrong with it. */
export function checkNumber(text: string, range: NumberRange, unit: string): number | string {
  const value = parseNumber(text);
  const bounds = `${editable(range.min)} to ${editable(range.max)} ${unit}`.trim();
  if (value === null) return `"${text}" is not a number: enter ${bounds}.`;
  if (range.whole && !Number.isInteger(value)) return `Enter a whole number, ${bounds}.`;
  if (value < range.min || value > range.max) return `${editable(value)} is out of range: enter ${bounds}.`;
  return value;
}

/** A problem below the panel's edge would go unread. */
const bringIntoSight = (problem: HTMLElement | null) => problem?.scrollIntoView({ block: "nearest" });

/** A number with its unit. Typing takes effect on Enter or when leaving the field; arrows step; Esc gives up. */
export function NumberField(props: Props) {
  const id = useId();
  const [draft, setDraft] = useState<string | null>(null);
  const [problem, setProblem] = useState<string | null>(null);

  const commit = (text: string) => {
    const checked = checkNumber(text, props, props.unit);
    if (typeof checked === "string") {
      setProblem(checked);
      return;
    }
    setDraft(null);
    setProblem(null);
    if (checked !== props.value) props.onChange(checked);
  };
  const step = (sign: number, tenfold: boolean) => {
    const base = parseNumber(draft ?? "") ?? props.value;
    const next = base + sign * props.step * (tenfold ? 10 : 1);
    commit(editable(Math.min(props.max, Math.max(props.min, next))));
  };
  const onKeyDown = (event: KeyboardEvent) => {
    if (event.key === "Enter" && draft !== null) commit(draft);
    if (event.key === "ArrowUp" || event.key === "ArrowDown") {
      event.preventDefault();
      step(event.key === "ArrowUp" ? 1 : -1, event.shiftKey);
    }
    if (event.key === "Escape") {
      setDraft(null);
      setProblem(null);
    }
  };

  return (
    <div class={`field ${problem ? "invalid" : ""} ${props.bare ? "bare" : ""}`}>
      <label for={id} class={props.bare ? "visually-hidden" : ""}>
        {props.label}
      </label>
      <span class="input">
        <input
          id={id}
          type="text"
          inputMode="decimal"
          autocomplete="off"
          disabled={props.disabled}
          data-testid={props.testid}
          aria-invalid={problem !== null}
          aria-describedby={problem ? `${id}-problem` : undefined}
          value={draft ?? editable(props.value)}
          onInput={(event) => setDraft(event.currentTarget.value)}
          onBlur={() => draft !== null && commit(draft)}
          onKeyDown={onKeyDown}
        />
        {props.unit && <span class="unit">{props.unit}</span>}
      </span>
      {problem && (
        <p class="problem" id={`${id}-problem`} role="alert" ref={bringIntoSight}>
          {problem}
        </p>
      )}
    </div>
  );
}

export interface NumberSpec<Key extends string> {
  key: Key;
  label: string;
  unit: string;
  step: number;
  /** Whole numbers only. */
  whole?: boolean;
}

interface FieldsProps<Key extends string> {
  fields: readonly NumberSpec<Key>[];
  limits: Readonly<Record<Key, { min: number; max: number }>>;
  values: Readonly<Record<Key, number>>;
  disabled?: boolean;
  /** Their test ids begin so. */
  group: string;
  onChange: (key: Key, value: number) => void;
}

/** Numbers that belong together, one field for each. */
export function NumberFields<Key extends string>({
  fields,
  limits,
  values,
  disabled = false,
  group,
  onChange,
}: FieldsProps<Key>) {
  return (
    <>
      {fields.map(({ key, ...field }) => (
        <NumberField
          key={key}
          {...field}
          {...limits[key]}
          value={values[key]}
          disabled={disabled}
          testid={`${group}-${key}`}
          onChange={(value) => onChange(key, value)}
        />
      ))}
    </>
  );
}
