import { clock } from "../format";
import { TextField } from "../ui/fields";
import { Button } from "../ui/Button";
import { Icon } from "../ui/Icon";
import { theme } from "../store/prefs";
import { edit } from "../store/plan";
import { document_, link, plan, saving } from "../store/state";
import { redo, undo } from "../plan/commands";
import { VerdictBadge } from "../plan/Verdict";
import { JobList } from "./JobList";
import { NoticeMenu } from "./Notices";
import { drawer, openDialog } from "./ui_state";
import { activeView, views } from "./views";

function Brand() {
  return (
    <span class="brand">
      <svg viewBox="0 0 32 24" width="30" height="22" aria-hidden="true">
        <path class="brand-hill" d="M1 23 10 13l5 5 7-10 9 15z" />
        <path class="brand-path" d="M1 13c6 0 6-6 10-6 4 0 3 3 6 2 3-2 4-7 14-7" />
      </svg>
      <span class="brand-name">Hedgehop</span>
    </span>
  );
}

function SavedState() {
  const state = plan.value;
  if (!state) return <span class="saved">Loading…</span>;
  const pending = link.value === "open" ? "Saving…" : "Not saved yet";
  const text = saving.value ? pending : `Saved ${clock(state.saved_utc)}`;
  return (
    <span class="saved" data-testid="saved-state">
      {text}
    </span>
  );
}

function PlanName() {
  const rename = (name: string) => name && edit("Rename plan", "plan", (doc) => ({ ...doc, name }));
  return (
    <div class="plan-name">
      <TextField
        bare
        label="Plan name"
        testid="plan-name"
        value={document_.value?.name ?? ""}
        onChange={rename}
      />
      <Button
        kind="quiet"
        icon="folder"
        title="Plans: open, new, save as"
        testid="plans-button"
        onClick={() => (openDialog.value = "plans")}
      />
      <SavedState />
    </div>
  );
}

function UndoRedo() {
  const state = plan.value;
  const undoTitle = `Undo ${state?.undo_label ?? ""}`.trim();
  const redoTitle = `Redo ${state?.redo_label ?? ""}`.trim();
  return (
    <div class="group">
      <Button
        kind="quiet"
        icon="undo"
        title={`${undoTitle} (Ctrl+Z)`}
        testid="undo"
        disabled={!state?.can_undo && !saving.value}
        onClick={undo}
      />
      <Button
        kind="quiet"
        icon="redo"
        title={`${redoTitle} (Ctrl+Shift+Z)`}
        testid="redo"
        disabled={!state?.can_redo}
        onClick={redo}
      />
    </div>
  );
}

function LinkBadge() {
  const state = link.value;
  const text = { open: "Connected", connecting: "Connecting…", lost: "Connection lost – retrying" }[state];
  return (
    <span class={`link-badge ${state}`} role="status" data-testid="link-state">
      <span class="dot" aria-hidden="true" />
      <span class="link-text">{text}</span>
    </span>
  );
}

function ThemeToggle() {
  const isDark = theme.value === "dark";
  const title = isDark ? "Daylight colours" : "Dark colours";
  return (
    <Button
      kind="quiet"
      icon={isDark ? "sun" : "moon"}
      title={title}
      testid="theme-toggle"
      onClick={() => (theme.value = isDark ? "light" : "dark")}
    />
  );
}

function Tabs() {
  return (
    <nav class="tabs" aria-label="Views">
      {views.map((view) => (
        <button
          type="button"
          key={view.id}
          aria-current={view === activeView.value ? "page" : undefined}
          data-testid={`tab-${view.id}`}
          onClick={() => (activeView.value = view)}
        >
          {view.label}
        </button>
      ))}
    </nav>
  );
}

function DrawerButton({
  side,
  label,
  icon,
}: {
  side: "left" | "right";
  label: string;
  icon: "menu" | "check";
}) {
  const open = drawer.value === side;
  return (
    <button
      type="button"
      class="drawer-button"
      aria-expanded={open}
      data-testid={`drawer-${side}`}
      onClick={() => (drawer.value = open ? null : side)}
    >
      <Icon name={icon} />
      <span>{label}</span>
    </button>
  );
}

export function StatusBar() {
  return (
    <header class="status-bar">
      <DrawerButton side="left" label="Plan" icon="menu" />
      <Brand />
      <Tabs />
      <PlanName />
      <UndoRedo />
      <span class="spring" />
      <JobList />
      <LinkBadge />
      <button
        type="button"
        class="verdict-button"
        title="Certificate"
        onClick={() => (drawer.value = drawer.value === "right" ? null : "right")}
      >
        <VerdictBadge />
      </button>
      <div class="group">
        <NoticeMenu />
        <ThemeToggle />
        <Button
          kind="quiet"
          icon="help"
          title="Help and keys (?)"
          testid="help"
          onClick={() => (openDialog.value = "help")}
        />
      </div>
    </header>
  );
}
