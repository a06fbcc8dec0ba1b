import { useState } from "preact/hooks";
import { forConsole, metres, number, percent } from "../../format";
import type { TerrainDoc } from "../../messages";
import { Button } from "../../ui/Button";
import { Icon } from "../../ui/Icon";
import { removeSpikes } from "../../store/plans";
import { ReadAgain } from "./RasterHints";

function Spikes({ entry }: { entry: TerrainDoc }) {
  if (entry.spikes.length === 0) return null;
  const heights = entry.spikes.map((spike) => Math.abs(spike.height_m));
  return (
    <div class="callout">
      <Icon name="warning" />
      <p>
        {entry.spikes.length} isolated {entry.spikes.length === 1 ? "spike" : "spikes and pits"}, up to{" "}
        {metres(Math.max(...heights))}. Masts are real: remove only what is noise.
      </p>
      <Button testid="remove-spikes" onClick={() => void removeSpikes(entry.id)}>
        Remove
      </Button>
    </div>
  );
}

/** What a surface model is, and what is doubtful about it. */
export function TerrainFacts({ entry }: { entry: TerrainDoc }) {
  const [rereadId, setRereadId] = useState<string | null>(null);
  const [width_m, height_m] = [entry.width_px * entry.resolution_m, entry.height_px * entry.resolution_m];
  return (
    <>
      <details class="details">
        <summary>
          {number(width_m)} × {metres(height_m, 0)}
          <span class="muted"> · {entry.vertical_datum ?? "datum unknown"} · details</span>
        </summary>
        <dl class="facts-list">
          <dt>Size</dt>
          <dd>
            {number(entry.width_px)} × {number(entry.height_px)} cells
          </dd>
          <dt>Heights</dt>
          <dd>
            {number(entry.min_m, 1)} to {metres(entry.max_m)}
          </dd>
          <dt>CRS</dt>
          <dd>{entry.crs}</dd>
          <dt>Datum</dt>
          <dd>{entry.vertical_datum ?? "unknown: altitudes relative to home only"}</dd>
          <dt>Unknown</dt>
          <dd>{percent(entry.unknown_share, 1)} of the cells</dd>
          <dt>Resolution</dt>
          <dd>{metres(entry.resolution_m, 3)} per cell</dd>
        </dl>
      </details>
      <Spikes entry={entry} />
      {entry.warnings.map((warning) => (
        <p class="callout" key={warning}>
          <Icon name="warning" /> {forConsole(warning)}
        </p>
      ))}
      {rereadId === entry.id ? (
        <ReadAgain name={entry.name} onDone={() => setRereadId(null)} />
      ) : (
        <Button kind="quiet" icon="import" testid="read-again" onClick={() => setRereadId(entry.id)}>
          Declare CRS, unit or datum…
        </Button>
      )}
    </>
  );
}
