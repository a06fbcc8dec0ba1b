import type { ComponentChildren } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";

interface Props {
  /** The button that opens it. */
  trigger: (props: { open: boolean; toggle: () => void }) => ComponentChildren;
  label: string;
  class?: string;
  testid?: string;
  children: (close: () => void) => ComponentChildren;
}

/** Something that opens beside its button and closes with Esc, a click elsewhere, or a choice. */
export function Menu({ trigger, label, children, testid, ...props }: Props) {
  const [open, setOpen] = useState(false);
  const root = useRef<HTMLDivElement>(null);
  const close = () => setOpen(false);

  useEffect(() => {
    if (!open) return undefined;
    const outside = (event: Event) => {
      if (!root.current?.contains(event.target as Node)) close();
    };
    // The 3D view is a page of its own: a click on it only shows as a lost focus.
    const left = () => document.activeElement?.tagName === "IFRAME" && close();
    document.addEventListener("pointerdown", outside);
    window.addEventListener("blur", left);
    return () => {
      document.removeEventListener("pointerdown", outside);
      window.removeEventListener("blur", left);
    };
  }, [open]);

  const onKeyDown = (event: KeyboardEvent) => {
    if (event.key === "Escape" && open) {
      event.stopPropagation();
      close();
      root.current?.querySelector<HTMLElement>("button")?.focus();
    }
    if (event.key === "ArrowDown" || event.key === "ArrowUp") moveFocus(event);
  };
  const moveFocus = (event: KeyboardEvent) => {
    const items = [...(root.current?.querySelectorAll<HTMLElement>("[role=menuitem]:not(:disabled)") ?? [])];
    if (!open || items.length === 0) return;
    event.preventDefault();
    const at = items.indexOf(document.activeElement as HTMLElement);
    const next = event.key === "ArrowDown" ? at + 1 : at - 1;
    items[(next + items.length) % items.length]?.focus();
  };

  return (
    <div class={`menu ${props.class ?? ""}`} ref={root} onKeyDown={onKeyDown}>
      {trigger({ open, toggle: () => setOpen(!open) })}
      {open && (
        <div class="menu-panel" aria-label={label} role="group" data-testid={testid}>
          {children(close)}
        </div>
      )}
    </div>
  );
}
