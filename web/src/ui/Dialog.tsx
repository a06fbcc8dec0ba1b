import type { ComponentChildren } from "preact";
import { useId, useLayoutEffect, useRef } from "preact/hooks";
import { Button } from "./Button";

interface Props {
  title: string;
  testid: string;
  onClose: () => void;
  children: ComponentChildren;
}

/** A modal dialog: the browser keeps the focus inside, and Esc closes it. */
export function Dialog({ title, testid, onClose, children }: Props) {
  const id = useId();
  const ref = useRef<HTMLDialogElement>(null);
  const gone = useRef(false);
  // Before the next key: an Esc between drawing and opening would be lost.
  useLayoutEffect(() => {
    const dialog = ref.current;
    if (dialog && !dialog.open) dialog.showModal();
    return () => {
      gone.current = true;
      dialog?.close();
    };
  }, []);
  // The event comes late: a dialog that gave way to another one must not close that one.
  const onClosed = () => !gone.current && onClose();
  const onBackdrop = (event: MouseEvent) => {
    if (event.target === ref.current) onClose();
  };
  return (
    <dialog ref={ref} aria-labelledby={id} data-testid={testid} onClose={onClosed} onMouseDown={onBackdrop}>
      <div class="dialog-body">
        <header>
          <h2 id={id}>{title}</h2>
          <Button kind="quiet" icon="cross" title="Close" onClick={onClose} />
        </header>
        {children}
      </div>
    </dialog>
  );
}
