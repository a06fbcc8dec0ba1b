import { forConsole } from "../format";
import type { ErrorDoc } from "../messages";
import { outcomes } from "../store/outcomes";
import { errors, setError } from "../store/state";
import { Button } from "./Button";
import { Icon } from "./Icon";

/** That the last command given at this place was done. */
export function Done({ place }: { place: string }) {
  const text = outcomes.value[place];
  return (
    <div class="outcome" aria-live="polite" data-testid={`outcome-${place}`}>
      {text && (
        <p class="done">
          <Icon name="check" size={16} /> {text}
        </p>
      )}
    </div>
  );
}

/** What the last command given at this place came to: done, or what was wrong and the way out. */
export function Outcome({ place }: { place: string }) {
  return (
    <>
      <ErrorBox place={place} />
      <Done place={place} />
    </>
  );
}
