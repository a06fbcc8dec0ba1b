import type { ComponentChildren } from "preact";
import { Icon, type IconName } from "./Icon";

interface Props {
  icon?: IconName;
  /** For buttons that show only an icon, and as the tooltip of all. */
  title?: string;
  kind?: "plain" | "quiet" | "primary" | "danger";
  pressed?: boolean;
  disabled?: boolean;
  testid?: string;
  onClick?: (event: MouseEvent) => void;
  children?: ComponentChildren;
  class?: string;
}

export function Button(props: Props) {
  const { icon, title, kind = "plain", pressed, disabled, testid, onClick, children } = props;
  const isBare = children === undefined;
  return (
    <button
      type="button"
      class={`button ${kind} ${isBare ? "bare" : ""} ${props.class ?? ""}`}
      title={title}
      aria-label={isBare ? title : undefined}
      aria-pressed={pressed}
      disabled={disabled}
      data-testid={testid}
      onClick={onClick}
    >
      {icon && <Icon name={icon} />}
      {children}
    </button>
  );
}

/** A choice among a few, as one row of buttons. */
export function Segmented<T extends string>(props: {
  label: string;
  value: T;
  options: readonly { value: T; label: string; title?: string; disabled?: boolean }[];
  testid?: string;
  onChange: (value: T) => void;
}) {
  return (
    <div class="segmented" role="group" aria-label={props.label} data-testid={props.testid}>
      {props.options.map((option) => (
        <button
          type="button"
          key={option.value}
          title={option.title}
          disabled={option.disabled}
          aria-pressed={option.value === props.value}
          data-testid={props.testid && `${props.testid}-${option.value}`}
          onClick={() => option.value !== props.value && props.onChange(option.value)}
        >
          {option.label}
        </button>
      ))}
    </div>
  );
}
