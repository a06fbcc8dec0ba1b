import { forConsole } from "../format";
import type { ErrorDoc } from "../messages";
import { outcomes } from "../store/outcomes";
import { errors, setError } from "../store/state";
import { Button } from "./Button";
import { Icon } from "./Icon";

/** What is wrong, where, and the way out. */
export function ErrorText({ error }: { error: ErrorDoc }) {
  return (
    <div class="error-text">
      <p class="what">{error.what}</p>
      {error.where && <p class="where">{error.where}</p>}
      {error.advice && <p class="advice">{forConsole(error.advice)}</p>}
    </div>
  );
}

export function ErrorPanel({ error, onClose }: { error: ErrorDoc; onClose?: () => void }) {
  return (
    <div class="error-box" role="alert" data-testid="error-box" data-code={error.code}>
      <Icon name="warning" />
      <ErrorText error={error} />
      {onClose && <Button kind="quiet" icon="cross" title="Dismiss" onClick={onClose} />}
    </div>
  );
}

/** The error that happened at this part of the page, if any. */
export function ErrorBox({ place }: { place: string }) {
  const error = errors.value[place];
  return error ? <ErrorPanel error={error} onClose={() => setError(place, null)} /> : null;
}

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
