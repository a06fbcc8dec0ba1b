import { degrees } from "../../format";
import { LIMITS, type PlanDoc, type PoiDoc } from "../../messages";
import { Button } from "../../ui/Button";
import { Icon } from "../../ui/Icon";
import { NumberField } from "../../ui/NumberField";
import { TextField } from "../../ui/fields";
import { poiTitle, withPoi } from "../../store/poi";
import { edit } from "../../store/plan";
import { aroundTo } from "../../store/fence";
import { result, selection } from "../../store/state";
import { setSelection } from "../../store/stream";
import { removeSelectedPoi } from "../../store/plans";
import { CopyPlace } from "../../ui/CopyPlace";
import { drag, dropClass, movePoi, startDrag } from "./poi_drag";

/** More rows than anyone edits by hand would only make the page slow. */
const MOST_ROWS = 300;

function onRowKey(event: KeyboardEvent, poi: PoiDoc, index: number, last: number): void {
  if (!event.altKey || (event.key !== "ArrowUp" && event.key !== "ArrowDown")) return;
  event.preventDefault();
  movePoi(poi, index, Math.min(last, Math.max(0, index + (event.key === "ArrowUp" ? -1 : 1))));
}

/** Said in the line that is there anyway: nothing moves when it comes. */
function Around({ index }: { index: number }) {
  const shapes = aroundTo(result.value?.detours ?? [], index).join(", ");
  if (!shapes) return null;
  return (
    <span class="around" data-testid="poi-around" title={`The way to this point is laid around ${shapes}`}>
      around {shapes}
    </span>
  );
}

function RowFields({ poi, index }: { poi: PoiDoc; index: number }) {
  const number = index + 1;
  const set = (label: string, fields: Partial<PoiDoc>) => edit(label, "points", withPoi(poi.id, fields));
  return (
    <div class="poi-fields">
      <TextField
        bare
        label={`Name of point ${number}`}
        placeholder={`Point ${number}`}
        testid="poi-name"
        value={poi.name}
        onChange={(name) => set(`Rename point ${number}`, { name })}
      />
      <NumberField
        bare
        label={`Loiter at point ${number}`}
        unit="s"
        {...LIMITS.PoiDoc.loiter_s}
        step={1}
        value={poi.loiter_s}
        testid="poi-loiter"
        onChange={(loiter_s) => set(`Loiter at point ${number}`, { loiter_s })}
      />
      <span class="coordinates" data-testid="poi-coordinates">
        <span>{degrees(poi.lat_deg)}</span>
        <span>{degrees(poi.lon_deg)}</span>
        <CopyPlace place={poi} name={poiTitle(poi, index)} />
        <Around index={index} />
      </span>
    </div>
  );
}

function Row({ poi, index, last }: { poi: PoiDoc; index: number; last: number }) {
  const isSelected = selection.value.poi_id === poi.id;
  const select = () =>
    selection.value.poi_id !== poi.id && setSelection({ poi_id: poi.id, fence_mark: null });
  return (
    <li
      class={`poi ${isSelected ? "selected" : ""} ${drag.value?.id === poi.id ? "dragged" : ""} ${dropClass(index)}`}
      data-testid="poi-row"
      data-poi={poi.id}
      data-index={index}
      aria-current={isSelected}
      onFocusCapture={select}
      onClick={select}
      onKeyDown={(event) => onRowKey(event, poi, index, last)}
    >
      <button
        type="button"
        class="handle"
        data-testid="poi-handle"
        title={`Point ${index + 1}: drag to reorder, or Alt+Up and Alt+Down`}
        onPointerDown={(event) => startDrag(event, poi, index)}
      >
        <Icon name="grip" size={14} />
        <span class="badge">{index + 1}</span>
      </button>
      <RowFields poi={poi} index={index} />
      <Button
        kind="quiet"
        class="small"
        icon="trash"
        testid="poi-delete"
        title={`Delete ${poiTitle(poi, index)}`}
        onClick={() => removeSelectedPoi(poi.id)}
      />
    </li>
  );
}

export function PoiList({ plan }: { plan: PlanDoc }) {
  const { pois } = plan;
  if (pois.length === 0) {
    return (
      <p class="teach">
        {plan.terrain_id
          ? "Press Add and click the surface, or drop a file of points. Two are enough for a path."
          : "Points come after the terrain."}
      </p>
    );
  }
  return (
    <>
      <div class="poi-head" aria-hidden="true">
        <span>Name, position</span>
        <span>Loiter</span>
      </div>
      <ol class="poi-list">
        {pois.slice(0, MOST_ROWS).map((poi, index) => (
          <Row key={poi.id} poi={poi} index={index} last={pois.length - 1} />
        ))}
      </ol>
      {pois.length > MOST_ROWS && (
        <p class="muted">
          {pois.length - MOST_ROWS} more points are flown but not listed: edit them in the file, then import
          it.
        </p>
      )}
    </>
  );
}
