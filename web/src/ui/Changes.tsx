import type { ComponentChildren } from "preact";
import { whyObserver } from "../store/flying";

/**
 * What changes something for everybody: observers see it, off, and it says why. Their pointer passes through to this
 * element (account.css), whose title is shown whatever the controls' own titles say.
 */
export function Changes({ children }: { children: ComponentChildren }) {
  const why = whyObserver.value;
  return (
    <fieldset class="changes" disabled={why !== null} title={why ?? undefined}>
      {children}
    </fieldset>
  );
}
