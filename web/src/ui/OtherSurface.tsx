import type { ComponentChildren } from "preact";
import { Icon } from "./Icon";

/** Before every figure: these are of another surface model than the mission was planned on. */
export function OtherSurface({ text, children }: { text: string; children?: ComponentChildren }) {
  if (!text) return null;
  return (
    <ul class="warnings other-surface" role="alert" data-testid="other-surface">
      <li>
        <Icon name="warning" />
        <span>
          {text} {children}
        </span>
      </li>
    </ul>
  );
}
