import { forConsole } from "../format";
import type { ErrorDoc } from "../messages";
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
