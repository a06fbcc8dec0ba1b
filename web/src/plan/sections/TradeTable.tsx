import { duration, number } from "../../format";
import { isFresh, result } from "../../store/state";

/** Fewer waypoints against excess height: a click on a row takes it. */
export function TradeTable(props: { chosen_m: number; onChoose: (excess_height_m: number) => void }) {
  const rows = result.value?.trade ?? [];
  if (rows.length === 0) return <p class="hint">How far the flown lines may run above the path.</p>;
  return (
    <table class={`trade ${isFresh.value ? "" : "stale"}`} data-testid="trade-table">
      <thead>
        <tr>
          <th scope="col">Excess</th>
          <th scope="col">Waypoints</th>
          <th scope="col">Duration</th>
          <th>
            <span class="visually-hidden">Choose</span>
          </th>
        </tr>
      </thead>
      <tbody>
        {rows.map((row) => {
          const isChosen = Math.abs(row.excess_height_m - props.chosen_m) < 1e-6;
          return (
            <tr key={row.excess_height_m} class={isChosen ? "chosen" : ""}>
              <td>{number(row.excess_height_m, 2)} m</td>
              <td>{number(row.waypoints)}</td>
              <td>{duration(row.duration_s)}</td>
              <td>
                {isChosen ? (
                  <span class="muted">set</span>
                ) : (
                  <button
                    type="button"
                    class="link"
                    aria-label={`Use ${row.excess_height_m} m`}
                    onClick={() => props.onChoose(row.excess_height_m)}
                  >
                    Use
                  </button>
                )}
              </td>
            </tr>
          );
        })}
      </tbody>
    </table>
  );
}
