import { AccountsDialog } from "../account/AccountsDialog";
import { AuditDialog } from "../account/AuditDialog";
import { ParametersDialog } from "../fly/ParametersDialog";
import { AskedForControl } from "../account/AskedForControl";
import { Scene } from "../scene/Scene";
import { ChecklistDialog } from "../plan/ChecklistDialog";
import { SaveAsDialog, PlansDialog } from "../plan/PlansDialog";
import { SpaceDialog } from "../review/SpaceDialog";
import { Alarms } from "./Alarms";
import { FileDrop } from "./FileDrop";
import { FleetStrip } from "./FleetStrip";
import { HelpSheet } from "./HelpSheet";
import { Toasts } from "./Notices";
import { StatusBar } from "./StatusBar";
import { VehicleStrip } from "./VehicleStrip";
import { active } from "../store/fleet";
import { drawer, openDialog } from "../store/view";
import { onKey } from "./keyboard";
import { activeView } from "./views";

/** Who holds a button down while another vehicle is shown gives that one no order: what is pressed goes with the key. */
export function App() {
  const { id, Left, Right, Below, Over } = activeView.value;
  const open = drawer.value;
  return (
    <div class="app" data-drawer={open ?? "none"} data-view={id}>
      <StatusBar />
      <VehicleStrip key={active.value} />
      <aside class="panel left" aria-label="What I do" data-testid="panel-left">
        <Left key={active.value} />
      </aside>
      <main class="centre">
        <FleetStrip />
        <Scene onKey={onKey}>
          <Alarms />
          <Toasts />
        </Scene>
        <Below />
        {Over && <Over />}
      </main>
      <aside class="panel right" aria-label="What is true" data-testid="panel-right">
        <Right key={active.value} />
      </aside>
      {open && (
        <button
          type="button"
          class="drawer-veil"
          aria-label="Close panel"
          onClick={() => (drawer.value = null)}
        />
      )}
      <FileDrop />
      {openDialog.value === "help" && <HelpSheet />}
      {openDialog.value === "plans" && <PlansDialog />}
      {openDialog.value === "accounts" && <AccountsDialog />}
      {openDialog.value === "audit" && <AuditDialog />}
      {openDialog.value === "parameters" && <ParametersDialog />}
      {openDialog.value === "checklist" && <ChecklistDialog />}
      {openDialog.value === "space" && <SpaceDialog />}
      <AskedForControl />
      {openDialog.value === "save_as" && <SaveAsDialog />}
    </div>
  );
}
