import type { ComponentChildren } from "preact";
import { useId, useState } from "preact/hooks";
import { NumberField, type NumberRange } from "./NumberField";

interface SliderProps extends NumberRange {
  label: string;
  hint?: string;
  unit: string;
  value: number;
  /** The slider's own end, where the field allows more. */
  sliderMax?: number;
  testid: string;
  onChange: (value: number, dragging: boolean) => void;
}

/** A number that is tuned by hand: slider and field in one. */
export function SliderField(props: SliderProps) {
  const { label, hint, value, min, step, testid, onChange } = props;
  const max = props.sliderMax ?? props.max;
  const share = Math.min(1, Math.max(0, (value - min) / (max - min)));
  return (
    <div class="slider-field">
      <NumberField {...props} testid={`${testid}-input`} onChange={(next) => onChange(next, false)} />
      <input
        type="range"
        aria-label={`${label}, slider`}
        data-testid={`${testid}-slider`}
        style={{ "--share": `${share * 100}%` }}
        min={min}
        max={max}
        step={step}
        value={value}
        onInput={(event) => onChange(Number(event.currentTarget.value), true)}
      />
      {hint && <p class="hint">{hint}</p>}
    </div>
  );
}

export function SelectField<T extends string>(props: {
  label: string;
  value: T;
  options: readonly { value: T; label: string }[];
  testid?: string;
  onChange: (value: T) => void;
}) {
  const id = useId();
  return (
    <div class="field">
      <label for={id}>{props.label}</label>
      <select
        id={id}
        data-testid={props.testid}
        value={props.value}
        onChange={(event) => props.onChange(event.currentTarget.value as T)}
      >
        {props.options.map((option) => (
          <option key={option.value} value={option.value}>
            {option.label}
          </option>
        ))}
      </select>
    </div>
  );
}

export function Check(props: {
  label: ComponentChildren;
  checked: boolean;
  disabled?: boolean;
  testid?: string;
  onChange: (checked: boolean) => void;
}) {
  return (
    <label class="check">
      <input
        type="checkbox"
        checked={props.checked}
        disabled={props.disabled}
        data-testid={props.testid}
        onChange={(event) => props.onChange(event.currentTarget.checked)}
      />
      <span>{props.label}</span>
    </label>
  );
}

/** A value that Hedgehop chooses unless the operator sets an own one. */
export function AutoField(
  props: NumberRange & {
    label: string;
    unit: string;
    auto: string;
    value: number | null;
    initial: number;
    testid: string;
    onChange: (value: number | null) => void;
  },
) {
  const isOwn = props.value !== null;
  return (
    <div class="auto-field">
      <Check
        label={
          <>
            {props.label} {!isOwn && <span class="muted">{props.auto}</span>}
          </>
        }
        checked={isOwn}
        testid={`${props.testid}-own`}
        onChange={(own) => props.onChange(own ? props.initial : null)}
      />
      {props.value !== null && (
        <NumberField
          {...props}
          bare
          value={props.value}
          testid={`${props.testid}-input`}
          onChange={props.onChange}
        />
      )}
    </div>
  );
}

/** One line of text; takes effect on Enter or when leaving the field. */
export function TextField(props: {
  label: string;
  value: string;
  placeholder?: string;
  bare?: boolean;
  maxLength?: number;
  testid?: string;
  onChange: (value: string) => void;
}) {
  const id = useId();
  const [draft, setDraft] = useState<string | null>(null);
  const commit = () => {
    if (draft !== null && draft.trim() !== props.value) props.onChange(draft.trim());
    setDraft(null);
  };
  return (
    <div class={`field text ${props.bare ? "bare" : ""}`}>
      <label for={id} class={props.bare ? "visually-hidden" : ""}>
        {props.label}
      </label>
      <input
        id={id}
        type="text"
        autocomplete="off"
        spellcheck={false}
        maxLength={props.maxLength ?? 80}
        placeholder={props.placeholder}
        data-testid={props.testid}
        value={draft ?? props.value}
        onInput={(event) => setDraft(event.currentTarget.value)}
        onBlur={commit}
        onKeyDown={(event) => {
          if (event.key === "Enter") event.currentTarget.blur();
          if (event.key === "Escape") setDraft(null);
        }}
      />
    </div>
  );
}
