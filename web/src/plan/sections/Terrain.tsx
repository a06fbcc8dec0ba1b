import { clock, day, metres, number, withUnit } from "../../format";
import type { PlanDoc, TerrainDoc } from "../../messages";
import { Button } from "../../ui/Button";
import { Icon } from "../../ui/Icon";
import { Section } from "../../ui/Section";
import { chooseFiles } from "../../ui/choose_files";
import { offered, useTerrain } from "../../store/arrivals";
import { MODEL_FILES, sendOrthophoto, sendTerrain } from "../../store/files";
import { edit } from "../../store/plan";
import { library, terrain } from "../../store/state";
import { deleteTerrain, newPlan, useDemo } from "../../store/plans";
import { LayerControls } from "./Layers";
import { FailedJobs } from "./RasterHints";
import { TerrainFacts } from "./TerrainFacts";

/** A model that arrived while the plan had points on another one: what to do with it. */
function Offer({ plan }: { plan: PlanDoc }) {
  const entry = library.value.terrains.find((item) => item.id === offered.value);
  if (!entry || entry.id === plan.terrain_id) return null;
  const startNew = async () => {
    if (await newPlan()) useTerrain(entry);
  };
  return (
    <div class="callout offer" data-testid="terrain-offer">
      <Icon name="terrain" />
      <p>
        <strong>{entry.name}</strong> is ready. This plan has points on another model.
      </p>
      <div class="row wrap">
        <Button testid="offer-new" onClick={() => void startNew()}>
          New plan on it
        </Button>
        <Button testid="offer-use" onClick={() => useTerrain(entry)}>
          Use it here
        </Button>
        <Button kind="quiet" icon="cross" title="Not now" onClick={() => (offered.value = null)} />
      </div>
    </div>
  );
}

/** What tells one model from another of the same name, beside its picture, folder and CRS. */
function terrainMarks(entry: TerrainDoc): string {
  const [width_m, height_m] = [entry.width_px * entry.resolution_m, entry.height_px * entry.resolution_m];
  const cell = withUnit(entry.resolution_m, "m", entry.resolution_m < 0.1 ? 3 : 2);
  const date = day(entry.file_utc ?? entry.added_utc).slice(0, 10);
  return [`${number(width_m)} × ${metres(height_m, 0)}`, cell, date].join(" · ");
}

function Row({ entry, isUsed }: { entry: TerrainDoc; isUsed: boolean }) {
  return (
    <li class={isUsed ? "current" : ""} data-testid="terrain-row">
      <button type="button" class="pick" aria-pressed={isUsed} onClick={() => !isUsed && useTerrain(entry)}>
        <span class="radio" aria-hidden="true" />
        <img
          class="terrain-picture"
          src={`/api/terrains/${entry.id}/picture.png`}
          alt=""
          width={40}
          height={40}
          loading="lazy"
        />
        <span class="terrain-words">
          <span class="name" title={entry.name}>
            {entry.folder && <span class="muted">{entry.folder}/</span>}
            {entry.name}
          </span>
          <span
            class="muted terrain-marks"
            title={`${entry.crs}, read ${day(entry.added_utc)} ${clock(entry.added_utc)}`}
          >
            {terrainMarks(entry)}
          </span>
          <span class="muted terrain-marks">{entry.crs}</span>
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
  const choose = () => chooseFiles(MODEL_FILES, (files) => files.forEach((file) => void sendTerrain(file)));
  return (
    <div class={`drop-zone ${isFirst ? "first" : ""}`} data-testid="terrain-drop">
      {isFirst && <p>Drop a GeoTIFF or a point cloud anywhere on this page</p>}
      <div class="row">
        <Button icon="import" testid="terrain-file" onClick={choose}>
          Open model…
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
      <Offer plan={plan} />
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
