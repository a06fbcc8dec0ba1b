import { latLon, metres } from "../format";
import type { CursorMessage, ResultDoc } from "../messages";
import { levelOf, valueAt } from "./transform";

/** What holds at the marked place. The curves answer at once; the server's own values replace them. */
export function CursorValues({ result, cursor }: { result: ResultDoc; cursor: CursorMessage }) {
  const { chart, required_clearance_m } = result;
  const s_m = cursor.s_m ?? 0;
  const ground = cursor.ground_rel_home_m ?? valueAt(chart.s_m, chart.ground_rel_home_m, s_m);
  const path = cursor.path_rel_home_m ?? valueAt(chart.s_m, chart.path_rel_home_m, s_m);
  const distance = valueAt(chart.trend_s_m, chart.trend_distance_m, s_m);
  const place =
    cursor.lat_deg != null && cursor.lon_deg != null
      ? latLon({ lat_deg: cursor.lat_deg, lon_deg: cursor.lon_deg })
      : null;
  return (
    <dl class="cursor-values" data-testid="cursor-values">
      <dt>at</dt>
      <dd>{metres(s_m)}</dd>
      <dt>terrain</dt>
      <dd>{ground === null ? "unknown" : metres(ground)}</dd>
      <dt>path</dt>
      <dd>{metres(path)}</dd>
      <dt>clearance</dt>
      <dd class={`level ${levelOf(distance, required_clearance_m)}`}>
        {distance === null ? "unknown" : metres(distance, 2)}
      </dd>
      {place && <dd class="muted place">{place}</dd>}
    </dl>
  );
}
