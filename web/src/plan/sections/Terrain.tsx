import { withUnit } from "../../format";
import type { PlanDoc, TerrainDoc } from "../../messages";
import { Button } from "../../ui/Button";
import { Section } from "../../ui/Section";
import { chooseFiles } from "../../shell/keyboard";
import { sendOrthophoto, sendTerrain } from "../../store/files";
import { edit } from "../../store/plan";
import { library, terrain } from "../../store/state";
import { deleteTerrain, useDemo } from "../commands";
import { LayerControls } from "./Layers";
import { FailedJobs } from "./RasterHints";
import { TerrainFacts } from "./TerrainFacts";

const RASTERS = ".tif,.tiff,.asc,.txt";

function chooseTerrain(entry: TerrainDoc): void {
  const change = (doc: PlanDoc): PlanDoc => ({ ...doc, terrain_id: entry.id, orthophoto_id: null });
  edit(`Use ${entry.name}`, "terrain", change);
}

function Row({ entry, isUsed }: { entry: TerrainDoc; isUsed: boolean }) {
  return (
    <li class={isUsed ? "current" : ""} data-testid="terrain-row">
      <button
        type="button"
        class="pick"
        aria-pressed={isUsed}
        onClick={() => !isUsed && chooseTerrain(entry)}
      >
        <span class="radio" aria-hidden="true" />
        <span class="name">{entry.name}</span>
        <span class="muted number">
          {withUnit(entry.resolution_m, "m", entry.resolution_m < 0.1 ? 3 : 2)}
        </span>
      </button>
      {!isUsed && (
        <Button
          kind="quiet"
          class="small"
          icon="trash"
          title={`Delete ${entry.name}`}
          onClick={() => void deleteTerrain(entry.id)}
        />
      )}
    </li>
  );
}

function Orthophotos({ plan, entry }: { plan: PlanDoc; entry: TerrainDoc }) {
  const photos = library.value.orthophotos.filter((photo) => photo.terrain_id === entry.id);
  const use = (id: string | null) =>
    edit("Choose orthophoto", "terrain", (doc) => ({ ...doc, orthophoto_id: id }));
  return (
    <div class="row wrap">
      {photos.length > 0 && (
        <label class="field">
          <span>Orthophoto</span>
          <select
            value={plan.orthophoto_id ?? ""}
            onChange={(event) => use(event.currentTarget.value || null)}
          >
            <option value="">none</option>
            {photos.map((photo) => (
              <option key={photo.id} value={photo.id}>
                {photo.name}
              </option>
            ))}
          </select>
        </label>
      )}
      <Button
        kind="quiet"
        icon="plus"
        testid="orthophoto-add"
        onClick={() =>
          chooseFiles(".tif,.tiff", (files) => files.forEach((file) => void sendOrthophoto(file)))
        }
      >
        Add orthophoto
      </Button>
    </div>
  );
}

function AddTerrain({ isFirst }: { isFirst: boolean }) {
  const choose = () => chooseFiles(RASTERS, (files) => files.forEach((file) => void sendTerrain(file)));
  return (
    <div class={`drop-zone ${isFirst ? "first" : ""}`} data-testid="terrain-drop">
      {isFirst && <p>Drop a GeoTIFF anywhere on this page</p>}
      <div class="row">
        <Button icon="import" testid="terrain-file" onClick={choose}>
          Open GeoTIFF…
        </Button>
        <Button icon="terrain" testid="demo-button" onClick={() => void useDemo()}>
          Demo
        </Button>
      </div>
    </div>
  );
}

export function TerrainSection({ plan }: { plan: PlanDoc }) {
  const { terrains } = library.value;
  const used = terrain.value;
  return (
    <Section id="terrain" title="Terrain" icon="terrain" summary={used?.name ?? "none yet"} startsOpen>
      <FailedJobs />
      {terrains.length > 0 && (
        <ul class="pick-list" aria-label="Surface models">
          {terrains.map((entry) => (
            <Row key={entry.id} entry={entry} isUsed={entry.id === used?.id} />
          ))}
        </ul>
      )}
      <AddTerrain isFirst={terrains.length === 0} />
      {used && (
        <>
          <TerrainFacts entry={used} />
          <LayerControls />
          <Orthophotos plan={plan} entry={used} />
        </>
      )}
    </Section>
  );
}
