import type { ComponentChildren } from "preact";
import { computation, editedPlace, errors } from "../store/state";
import type { ErrorDoc } from "../messages";
import { openSections } from "../store/prefs";
import { Changes } from "./Changes";
import { ErrorBox, ErrorPanel } from "./Outcome";
import { Icon, type IconName } from "./Icon";

interface Props {
  id: string;
  title: string;
  icon: IconName;
  /** What the section holds, in a few words, read while it is closed. */
  summary?: string;
  startsOpen?: boolean;
  /** Something in it must be seen: it cannot be closed meanwhile. */
  isUrgent?: boolean;
  children: ComponentChildren;
}

export const sectionIsOpen = (id: string, startsOpen: boolean) => openSections.value[id] ?? startsOpen;

export function setSection(id: string, open: boolean): void {
  openSections.value = { ...openSections.value, [id]: open };
}

/** Why nothing can be computed since the last edit, if that edit was made in this section. */
function consequence(id: string): ErrorDoc | null {
  return editedPlace.value === id ? (computation.value?.error ?? null) : null;
}

/** A collapsible part of the left panel; errors of its edits appear at its top, and open it. */
export function Section({ id, title, icon, summary, startsOpen = false, isUrgent = false, children }: Props) {
  const wrong = consequence(id);
  const isWrong = errors.value[id] !== undefined || wrong !== null;
  const open = sectionIsOpen(id, startsOpen) || isUrgent || isWrong;
  return (
    <section class={`section ${open ? "open" : ""}`} data-section={id} data-testid={`section-${id}`}>
      <h2>
        <button
          type="button"
          aria-expanded={open}
          aria-controls={`section-${id}`}
          onClick={() => setSection(id, !open)}
        >
          <Icon name={icon} />
          <span class="title">{title}</span>
          {summary && <span class="summary">{summary}</span>}
          <Icon name="down" size={16} />
        </button>
      </h2>
      {open && (
        <div class="section-body" id={`section-${id}`}>
          <ErrorBox place={id} />
          {wrong && <ErrorPanel error={wrong} />}
          <Changes>{children}</Changes>
        </div>
      )}
    </section>
  );
}

/** A figure with its name, of a list of them. */
export function Fact({ label, value }: { label: string; value: string }) {
  return (
    <div class="figure">
      <dt>{label}</dt>
      <dd>{value}</dd>
    </div>
  );
}
