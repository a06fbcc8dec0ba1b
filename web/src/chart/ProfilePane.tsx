import { signal } from "@preact/signals";
import { count, latLon, metres } from "../format";
import { Segmented } from "../ui/Button";
import { throttled } from "../ui/throttle";
import { fly } from "../store/flying";
import { chartHeight_px } from "../store/prefs";
import { computation, cursor, isFresh, result } from "../store/state";
import { send } from "../store/stream";
import { viewId } from "../store/view";
import { Plot, type ChartKind } from "./Plot";
import { ResizeHandle } from "./ResizeHandle";
import type { CursorMessage, ResultDoc } from "../messages";
import { levelOf, valueAt } from "./transform";

const kind = signal<ChartKind>("altitude");
const tellServer = throttled<number | null>(1000 / 30, (s_m) => send({ type: "hover_profile", s_m }));

/** The line follows the pointer at once; the server's answer adds the place in 3D. */
function hover(s_m: number | null): void {
  cursor.value =
    s_m === null
      ? null
      : {
          v: 1,
          type: "cursor",
          s_m,
          lat_deg: null,
          lon_deg: null,
          ground_rel_home_m: null,
          path_rel_home_m: null,
        };
  tellServer(s_m);
}

function Keys({ flown }: { flown: boolean }) {
  if (kind.value === "distance") return <span class="muted">Distance to the surface model, in space</span>;
  return (
    <span class="chart-keys" aria-hidden="true">
      <span class="key ground">Terrain</span>
      <span class="key surface">Safe surface</span>
      <span class="key path">Path</span>
      <span class="key flown">Mission</span>
      {flown && <span class="key track">Flown</span>}
    </span>
  );
}

function Empty() {
  const now = computation.value;
  const text =
    now?.state === "running" ? "Computing the profile…" : now?.hint || "The altitude profile appears here.";
  return <p class="chart-empty muted">{text}</p>;
}

/** What holds at the marked place. The curves answer at once; the server's own values replace them. */
function CursorValues({ result, cursor }: { result: ResultDoc; cursor: CursorMessage }) {
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

export function ProfilePane() {
  const shown = result.value;
  const place = cursor.value?.s_m == null ? null : cursor.value;
  // What was taken up in flight begins elsewhere: its distances are not those of the open plan.
  const flown = viewId.value === "fly" && !fly.value?.taken_up;
  return (
    <section
      class="profile-pane"
      style={{ height: `${chartHeight_px.value}px` }}
      aria-label="Altitude profile"
    >
      <ResizeHandle />
      <header>
        <Segmented
          label="Chart"
          testid="chart"
          value={kind.value}
          options={[
            { value: "altitude", label: "Altitude" },
            { value: "distance", label: "Clearance" },
          ]}
          onChange={(next) => (kind.value = next)}
        />
        {shown && place ? <CursorValues result={shown} cursor={place} /> : shown && <Keys flown={flown} />}
        <span class="spring" />
        {shown && !place && <span class="muted">along path, m · {count(shown.waypoints, "waypoint")}</span>}
      </header>
      {shown ? (
        <div class={`plot-holder ${isFresh.value ? "" : "stale"}`}>
          <Plot kind={kind.value} result={shown} flown={flown} onHover={hover} />
        </div>
      ) : (
        <Empty />
      )}
    </section>
  );
}
