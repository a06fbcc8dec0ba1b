import type uPlot from "uplot";
import { aheadOf } from "../obstacles/ahead";
import { conflictWhere } from "../obstacles/words";
import { heard } from "../store/flying";
import { watching } from "../store/obstacles";
import { Icon } from "../ui/Icon";
import { VerticalLine } from "./ChartBox";

/** Where along the path the mission ahead meets what was seen. */
export function ConflictMark({ plot }: { plot: uPlot }) {
  const s_m = heard.live.value?.message.follow?.s_m;
  const { conflict } = aheadOf(watching("live"));
  if (s_m == null || !conflict) return null;
  const at = s_m + conflict.ahead_m;
  const x = plot.valToPos(at, "x");
  if (x < 0 || x > plot.over.clientWidth) return null;
  const style = { left: `${plot.over.offsetLeft + x}px`, top: `${plot.over.offsetTop}px` };
  return (
    <>
      <VerticalLine plot={plot} at={at} kind="conflict-line" testid="conflict-line" />
      <span class="conflict-mark" style={style} title={`Conflict ${conflictWhere(conflict)}`}>
        <Icon name="warning" size={16} />
      </span>
    </>
  );
}
