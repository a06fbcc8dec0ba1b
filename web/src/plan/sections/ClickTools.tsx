import { selection } from "../../store/state";
import { Icon, type IconName } from "../../ui/Icon";

export interface ClickTool<T extends string> {
  tool: T;
  icon: IconName;
  label: string;
  title: string;
}

interface Props<T extends string> {
  /** What the tools are for. */
  label: string;
  tools: readonly ClickTool<T>[];
  /** There is no surface to click on before a terrain is chosen. */
  hasTerrain: boolean;
  onTake: (tool: T) => void;
}

/** What a click on the surface does: one of a few tools is in hand. */
export function ClickTools<T extends string>({ label: group, tools, hasTerrain, onTake }: Props<T>) {
  return (
    <div class="tools" role="group" aria-label={group}>
      {tools.map(({ tool, icon, label, title }) => (
        <button
          type="button"
          key={tool}
          title={hasTerrain ? title : "Choose a terrain first"}
          disabled={!hasTerrain}
          aria-pressed={selection.value.tool === tool}
          data-testid={`tool-${tool}`}
          onClick={() => onTake(tool)}
        >
          <Icon name={icon} />
          {label}
        </button>
      ))}
    </div>
  );
}
