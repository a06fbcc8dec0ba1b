import { Icon, type IconName } from "./Icon";

interface Props {
  icon: IconName;
  text: string;
  note?: string;
  level?: "neutral" | "near" | "bad";
  stale?: boolean;
  title?: string;
  testid?: string;
  class?: string;
}

/** One value of the status bar: sign, words, and a quieter second value. */
export function Chip({ icon, text, note, level = "neutral", stale, title, testid, ...props }: Props) {
  return (
    <span
      class={`chip ${level} ${stale ? "old" : ""} ${props.class ?? ""}`}
      title={title}
      data-testid={testid}
      data-level={level}
    >
      <Icon name={level === "neutral" ? icon : "warning"} size={16} />
      <span class="chip-text">{text}</span>
      {note && <span class="chip-note">{note}</span>}
    </span>
  );
}
