import { useState } from "preact/hooks";
import { forConsole, metres, number, percent } from "../../format";
import type { CloudDoc, MeshDoc, TerrainDoc } from "../../messages";
import { Button } from "../../ui/Button";
import { Icon } from "../../ui/Icon";
import { deleteMesh, removeSpikes } from "../../store/plans";
import { library } from "../../store/state";
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

const leftOut = ({ noise, not_numbers }: CloudDoc) =>
  [noise > 0 && `${number(noise)} noise`, not_numbers > 0 && `${number(not_numbers)} without a place`]
    .filter(Boolean)
    .join(", ");

/** The point cloud that a model was made of: what its points are, and what became of them. */
function CloudFacts({ cloud, cell_m }: { cloud: CloudDoc; cell_m: number }) {
  const { canopy_share, canopy_median_m, canopy_greatest_m } = cloud;
  return (
    <dl class="facts-list" data-testid="cloud-facts">
      <dt>Points</dt>
      <dd>
        {number(cloud.taken)} of {number(cloud.points)}, {number(cloud.points_per_m2, 1)} per m²
      </dd>
      {leftOut(cloud) && (
        <>
          <dt>Left out</dt>
          <dd>{leftOut(cloud)}</dd>
        </>
      )}
      {cloud.made_model && (
        <>
          <dt>Cells</dt>
          <dd>
            {metres(cell_m, 2)}, {cloud.cell_chosen ? "as chosen" : "by the density"}; each as high as its
            highest point
          </dd>
        </>
      )}
      {cloud.shares.length > 0 && (
        <>
          <dt>Classes</dt>
          <dd>{cloud.shares.map(({ what, share }) => `${what} ${percent(share, 1)}`).join(", ")}</dd>
        </>
      )}
      {canopy_share !== null && (
        <>
          <dt>Above ground</dt>
          <dd>
            {percent(canopy_share)} of the cells with ground points by 2 m or more
            {canopy_median_m !== null && `, half of them by ${metres(canopy_median_m)} or more`}, at most{" "}
            {metres(canopy_greatest_m)}
          </dd>
        </>
      )}
      {cloud.made_model && (
        <>
          <dt>Small holes</dt>
          <dd>
            {cloud.small_holes === 0
              ? "none"
              : `${number(cloud.small_holes)}, ${number(cloud.small_holes_m2, 1)} m² in all: plans fill each with its highest neighbour`}
            ; larger ones than {number(cloud.small_hole_limit_m2)} m² stay unknown
          </dd>
        </>
      )}
    </dl>
  );
}

/** The textured mesh that is drawn in the model's place, and what was done to lay it there. */
function MeshFacts({ mesh }: { mesh: MeshDoc }) {
  return (
    <dl class="facts-list" data-testid="mesh-facts">
      <dt>Mesh</dt>
      <dd>
        {mesh.name}, {number(mesh.triangles)} triangles: a picture. Clearance is proved against the surface
        model alone.{" "}
        <Button
          kind="quiet"
          class="small"
          icon="trash"
          testid="mesh-delete"
          title={`Delete ${mesh.name}; the surface model stays`}
          onClick={() => void deleteMesh(mesh.id)}
        />
      </dd>
      {mesh.notes.length > 0 && (
        <>
          <dt>Of the mesh</dt>
          <dd>{mesh.notes.map(forConsole).join(" ")}</dd>
        </>
      )}
    </dl>
  );
}

/** What a surface model is, and what is doubtful about it. */
export function TerrainFacts({ entry }: { entry: TerrainDoc }) {
  const [rereadId, setRereadId] = useState<string | null>(null);
  const mesh = library.value.meshes.filter((each) => each.terrain_id === entry.id).at(-1);
  const isOfCloud = entry.cloud?.made_model === true;
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
        {mesh && <MeshFacts mesh={mesh} />}
        {entry.cloud && <CloudFacts cloud={entry.cloud} cell_m={entry.resolution_m} />}
      </details>
      <Spikes entry={entry} />
      {entry.warnings.map((warning) => (
        <p class="callout" key={warning}>
          <Icon name="warning" /> {forConsole(warning)}
        </p>
      ))}
      {rereadId === entry.id ? (
        <ReadAgain
          name={entry.name}
          {...(isOfCloud && !entry.cloud?.cell_chosen ? { made_m: entry.resolution_m } : {})}
          onDone={() => setRereadId(null)}
        />
      ) : (
        <Button kind="quiet" icon="import" testid="read-again" onClick={() => setRereadId(entry.id)}>
          Declare CRS, unit{isOfCloud ? ", cells" : ""} or datum…
        </Button>
      )}
    </>
  );
}
