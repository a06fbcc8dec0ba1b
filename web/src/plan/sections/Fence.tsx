import type { ComponentChildren } from "preact";
import { count, metres } from "../../format";
import {
  LIMITS,
  type FenceCircleDoc,
  type FencePolygonDoc,
  type PlanDoc,
  type RallyDoc,
} from "../../messages";
import { Button, Segmented } from "../../ui/Button";
import { chooseFiles } from "../../ui/choose_files";
import { AutoField } from "../../ui/fields";
import { Icon } from "../../ui/Icon";
import { Menu } from "../../ui/Menu";
import { NumberField } from "../../ui/NumberField";
import { Section } from "../../ui/Section";
import { editFence, editRally, editShape, removeMark, selectMark, shapeIdOf } from "../../store/fence";
import { sendFence } from "../../store/files";
import { selection } from "../../store/state";
import { setSelection } from "../../store/stream";
import { drawer } from "../../store/view";
import { download } from "../../store/downloads";
import { ClickTools } from "./ClickTools";

const TOOLS = [
  { tool: "fence_polygon", icon: "polygon", label: "Polygon", title: "Add corners of a polygon on click" },
  { tool: "fence_circle", icon: "record", label: "Circle", title: "Put a circle's centre on click" },
  { tool: "rally", icon: "flag", label: "Rally", title: "Put a place to return to on click" },
] as const;

const FILES = [
  { file: "fence.plan", label: "Fence and rally points", note: ".plan" },
  { file: "fence.kml", label: "Fence and rally points", note: ".kml" },
  { file: "fence.geojson", label: "Fence and rally points", note: ".geojson" },
  { file: "fence.waypoints", label: "Fence", note: ".waypoints" },
  { file: "rally.waypoints", label: "Rally points", note: ".waypoints" },
] as const;

const KINDS = [
  { value: "out", label: "Keep out" },
  { value: "in", label: "Stay inside" },
] as const;

/** On narrow screens the drawer would cover what is to be clicked. */
function take(tool: (typeof TOOLS)[number]["tool"]): void {
  setSelection({ tool, fence_mark: null, poi_id: null, draft: [] });
  drawer.value = null;
}

/** One shape or rally point: a press selects it, in the 3D view too. */
function Row(props: {
  id: string;
  mark: string;
  title: string;
  note?: string;
  onAdd?: () => void;
  children: ComponentChildren;
}) {
  const { id, mark, title, note, onAdd } = props;
  const isSelected = shapeIdOf(selection.value.fence_mark) === id;
  return (
    <li class={`fence-row ${isSelected ? "selected" : ""}`} aria-current={isSelected} data-testid="fence-row">
      <div class="row">
        <button type="button" class="fence-name" aria-pressed={isSelected} onClick={() => selectMark(mark)}>
          {title} {note && <span class="muted">{note}</span>}
        </button>
        {onAdd && (
          <Button kind="quiet" class="small" icon="plus" title={`Add corners to ${title}`} onClick={onAdd} />
        )}
        <Button
          kind="quiet"
          class="small"
          icon="trash"
          testid="fence-delete"
          title={`Delete ${title}`}
          onClick={() => removeMark(id)}
        />
      </div>
      {props.children}
    </li>
  );
}

function Kind(props: { title: string; inclusion: boolean; onChange: (inclusion: boolean) => void }) {
  return (
    <Segmented
      label={props.title}
      testid="fence-kind"
      value={props.inclusion ? "in" : "out"}
      options={KINDS}
      onChange={(kind) => props.onChange(kind === "in")}
    />
  );
}

function PolygonRow({ shape, index }: { shape: FencePolygonDoc; index: number }) {
  const title = `Polygon ${index + 1}`;
  const add = () => {
    setSelection({
      tool: "fence_polygon",
      fence_mark: `${shape.id}.${shape.corners.length - 1}`,
      poi_id: null,
    });
    drawer.value = null;
  };
  return (
    <Row
      id={shape.id}
      mark={`${shape.id}.0`}
      title={title}
      note={count(shape.corners.length, "corner")}
      onAdd={add}
    >
      <Kind
        title={title}
        inclusion={shape.inclusion}
        onChange={(inclusion) =>
          editShape("polygons", shape.id, `Change polygon ${index + 1}`, { inclusion })
        }
      />
    </Row>
  );
}

function CircleRow({ shape, index }: { shape: FenceCircleDoc; index: number }) {
  const title = `Circle ${index + 1}`;
  const label = `Change circle ${index + 1}`;
  return (
    <Row id={shape.id} mark={shape.id} title={title}>
      <Kind
        title={title}
        inclusion={shape.inclusion}
        onChange={(inclusion) => editShape("circles", shape.id, label, { inclusion })}
      />
      <NumberField
        label="Radius"
        unit="m"
        {...LIMITS.FenceCircleDoc.radius_m}
        step={1}
        value={shape.radius_m}
        testid="fence-radius"
        onChange={(radius_m) => editShape("circles", shape.id, label, { radius_m })}
      />
    </Row>
  );
}

function RallyRow({ point, index }: { point: RallyDoc; index: number }) {
  return (
    <Row id={point.id} mark={point.id} title={`Rally point ${index + 1}`}>
      <NumberField
        label="Height above home"
        unit="m"
        {...LIMITS.RallyDoc.alt_rel_home_m}
        step={1}
        value={point.alt_rel_home_m}
        testid="rally-height"
        onChange={(alt_rel_home_m) =>
          editRally(point.id, `Change rally point ${index + 1}`, { alt_rel_home_m })
        }
      />
    </Row>
  );
}

function Heights({ plan }: { plan: PlanDoc }) {
  const { floor_rel_home_m, ceiling_rel_home_m } = plan.fence;
  return (
    <>
      <AutoField
        label="Floor above home"
        auto="(none)"
        unit="m"
        {...LIMITS.FenceDoc.floor_rel_home_m}
        step={1}
        value={floor_rel_home_m}
        testid="fence-floor"
        onChange={(value) => editFence("Floor of the fence", () => ({ floor_rel_home_m: value }))}
      />
      <AutoField
        label="Ceiling above home"
        auto="(none)"
        unit="m"
        {...LIMITS.FenceDoc.ceiling_rel_home_m}
        step={1}
        value={ceiling_rel_home_m}
        testid="fence-ceiling"
        onChange={(value) => editFence("Ceiling of the fence", () => ({ ceiling_rel_home_m: value }))}
      />
    </>
  );
}

function summaryOf({ fence, rally }: PlanDoc): string {
  const shapes = fence.polygons.length + fence.circles.length;
  const { floor_rel_home_m: floor, ceiling_rel_home_m: ceiling } = fence;
  const words = [
    ...(shapes ? [count(shapes, "shape")] : []),
    ...(floor === null ? [] : [`above ${metres(floor)}`]),
    ...(ceiling === null ? [] : [`below ${metres(ceiling)}`]),
    ...(rally.length ? [count(rally.length, "rally point")] : []),
  ];
  return words.join(", ") || "none";
}

function Files({ isEmpty, isReady }: { isEmpty: boolean; isReady: boolean }) {
  const importFiles = () =>
    chooseFiles(".plan,.waypoints,.txt,.kml,.kmz,.geojson,.json", (files) =>
      files.forEach((file) => void sendFence(file)),
    );
  return (
    <div class="row">
      <Button icon="import" testid="fence-import" disabled={!isReady} onClick={importFiles}>
        Import…
      </Button>
      <Menu
        label="Export the fence"
        class="export"
        testid="fence-export-list"
        trigger={({ open, toggle }) => (
          <Button icon="export" testid="fence-export" pressed={open} disabled={isEmpty} onClick={toggle}>
            Export
          </Button>
        )}
      >
        {(close) =>
          FILES.map(({ file, label, note }) => (
            <button
              type="button"
              role="menuitem"
              class="menu-item"
              key={file}
              data-testid={`export-${file}`}
              onClick={() => {
                close();
                void download(file, `/api/plan/fence/${file}`, "fence");
              }}
            >
              <Icon name="export" />
              <span>{label}</span>
              <span class="muted">{note}</span>
            </button>
          ))
        }
      </Menu>
    </div>
  );
}

/** Where the vehicle may be, and where it may return to: the certificate holds the line and every way back to it. */
export function FenceSection({ plan }: { plan: PlanDoc }) {
  const { fence, rally } = plan;
  const isEmpty = summaryOf(plan) === "none";
  return (
    <Section id="fence" title="Fence" icon="shield" summary={summaryOf(plan)}>
      <ClickTools
        label="What clicks on the surface draw"
        tools={TOOLS}
        hasTerrain={Boolean(plan.terrain_id)}
        onTake={take}
      />
      {isEmpty && <p class="teach">Choose Polygon or Circle and click the surface, or import a file.</p>}
      <ul class="fence-list">
        {fence.polygons.map((shape, index) => (
          <PolygonRow key={shape.id} shape={shape} index={index} />
        ))}
        {fence.circles.map((shape, index) => (
          <CircleRow key={shape.id} shape={shape} index={index} />
        ))}
        {rally.map((point, index) => (
          <RallyRow key={point.id} point={point} index={index} />
        ))}
      </ul>
      <Heights plan={plan} />
      <Files isEmpty={isEmpty} isReady={plan.terrain_id !== null} />
    </Section>
  );
}
