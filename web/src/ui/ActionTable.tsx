import type { ComponentChildren } from "preact";

interface Props {
  class?: string;
  /** Whether the arrow keys scroll it: needed where none of its buttons may be in reach of Tab. */
  isReached?: boolean;
  /** The heads of the columns before the last one. */
  head: ComponentChildren;
  children: ComponentChildren;
}

/** Rows with buttons at their end; that column has its name for those alone who hear it. */
export function ActionTable({ class: more = "", isReached = false, head, children }: Props) {
  return (
    <div class="table-scroll" tabIndex={isReached ? 0 : undefined}>
      <table class={`plans ${more}`}>
        <thead>
          <tr>
            {head}
            <th>
              <span class="visually-hidden">Actions</span>
            </th>
          </tr>
        </thead>
        <tbody>{children}</tbody>
      </table>
    </div>
  );
}
