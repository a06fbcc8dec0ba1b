import type { ComponentChildren } from "preact";
import type { WayDoc } from "../messages";
import { Icon, type IconName } from "../ui/Icon";

interface VerdictProps {
  icon: IconName;
  words: string;
  /** What it is said of. */
  children: ComponentChildren;
}

/** The first line of a card about a way or a place. */
export function WayVerdict({ icon, words, children }: VerdictProps) {
  return (
    <strong class="way-verdict">
      <Icon name={icon} size={16} /> {words}
      <span class="muted">{children}</span>
    </strong>
  );
}

/** Why a way is not certified, and what to do about it. */
export function WayReasons({ reasons, testid }: { reasons: WayDoc["reasons"]; testid?: string }) {
  return (
    <ul class="way-reasons" data-testid={testid}>
      {reasons.map(({ code, text, mend }) => (
        <li key={code}>
          {text} {mend && <span class="muted">{mend}</span>}
        </li>
      ))}
    </ul>
  );
}
