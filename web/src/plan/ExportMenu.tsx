import { Icon, type IconName } from "../ui/Icon";
import { Menu } from "../ui/Menu";
import { computation } from "../store/state";
import { verdict, verdictWord } from "./Verdict";
import { busy, download, openReport } from "../store/downloads";

const FILES: readonly { file: string; label: string; note: string; icon: IconName }[] = [
  { file: "all.zip", label: "Everything", note: ".zip", icon: "folder" },
  { file: "mission.waypoints", label: "Mission", note: ".waypoints", icon: "route" },
  { file: "mission.plan", label: "QGroundControl plan", note: ".plan", icon: "route" },
  { file: "trajectory.csv", label: "Trajectory table", note: ".csv", icon: "chart" },
  { file: "trajectory.kml", label: "Trajectory for maps", note: ".kml", icon: "terrain" },
  { file: "mission.geojson", label: "Mission for maps", note: ".geojson", icon: "terrain" },
  { file: "certificate.json", label: "Certificate", note: ".json", icon: "check" },
];

function Item(props: { label: string; note: string; icon: IconName; testid: string; onClick: () => void }) {
  return (
    <button
      type="button"
      role="menuitem"
      class="menu-item"
      data-testid={props.testid}
      onClick={props.onClick}
    >
      <Icon name={props.icon} />
      <span>{props.label}</span>
      <span class="muted">{props.note}</span>
    </button>
  );
}

function Warning() {
  const kind = verdict();
  if (kind !== "not_certified" && kind !== "not_feasible") return null;
  return (
    <p class="menu-warning">
      <Icon name="warning" /> This plan is {verdictWord(kind)}. The files say so.
    </p>
  );
}

/** Why there is nothing to export yet. */
export function obstacle(): string | null {
  const now = computation.value;
  if (!now || now.state === "empty") return "Nothing to export yet";
  if (now.state === "error") return "The plan has an error: see the right panel";
  return now.state === "running" && !now.result ? "Computing…" : null;
}

/** Beside another primary action it is a plain button. */
export function ExportMenu({ isPrimary }: { isPrimary: boolean }) {
  const why = obstacle();
  return (
    <Menu
      label="Export"
      class="export"
      testid="export-list"
      trigger={({ open, toggle }) => (
        <button
          type="button"
          class={`button wide ${isPrimary ? "primary" : "tall"}`}
          aria-expanded={open}
          disabled={why !== null || busy.value}
          data-testid="export-menu"
          onClick={toggle}
        >
          <Icon name="export" />
          {busy.value ? "Exporting…" : "Export"}
          <Icon name={open ? "down" : "up"} size={16} />
        </button>
      )}
    >
      {(close) => {
        const then = (go: () => void) => () => {
          close();
          go();
        };
        return (
          <>
            <Warning />
            {FILES.map(({ file, ...item }) => (
              <Item
                key={file}
                {...item}
                testid={`export-${file}`}
                onClick={then(() => void download(file))}
              />
            ))}
            <hr />
            <Item
              label="Report"
              note="new tab"
              icon="chart"
              testid="export-report"
              onClick={then(() => openReport(false))}
            />
            <Item
              label="Print the report"
              note=""
              icon="print"
              testid="export-print"
              onClick={then(() => openReport(true))}
            />
          </>
        );
      }}
    </Menu>
  );
}
