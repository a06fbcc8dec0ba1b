import { withUnit } from "../format";
import { Button } from "../ui/Button";
import { Icon } from "../ui/Icon";
import { matching } from "../ui/media";
import { theme } from "../store/prefs";
import { me, whyObserver } from "../store/flying";
import { late_s } from "../store/reach";
import { link } from "../store/state";
import { SoundSwitch } from "./SoundSwitch";
import { Chip } from "../ui/Chip";
import { VerdictBadge } from "../plan/Verdict";
import { JobList } from "./JobList";
import { NoticeMenu } from "./Notices";
import { PlanName, UndoRedo } from "./PlanName";
import { drawer, goTo, openDialog } from "../store/view";
import { activeView, views } from "./views";

/** Below it the panels are drawers, as in layout.css. */
const NARROW_PX = 1100;

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

const LINK_WORDS = {
  open: "Connected",
  connecting: "Connecting…",
  silent: "The server is silent",
  lost: "No connection – retrying",
} as const;

/** Where there is little room its dot alone tells of a good line; on a phone of any: the strip below has the words. */
const isTight = matching("(max-width: 1240px)");
const isPhone = matching("(max-width: 720px)");

function LinkBadge() {
  const state = late_s.value === null ? link.value : "slow";
  const text = late_s.value === null ? LINK_WORDS[link.value] : `Page ${withUnit(late_s.value, "s")} late`;
  const isTucked = isPhone.value || (isTight.value && state === "open");
  return (
    <span class={`link-badge ${state}`} role="status" data-testid="link-state">
      <span class="dot" aria-hidden="true" />
      <span class={isTucked ? "visually-hidden" : ""}>{text}</span>
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
          onClick={() => goTo(view.id)}
        >
          {view.label}
        </button>
      ))}
    </nav>
  );
}

/** What the right panel holds, where it is a drawer and the certificate is not what it shows. */
function RightDrawerButton() {
  const { id } = activeView.value;
  if (id === "plan") return null;
  const open = drawer.value === "right";
  return (
    <button
      type="button"
      class="drawer-button right"
      aria-expanded={open}
      data-testid="drawer-facts"
      onClick={() => (drawer.value = open ? null : "right")}
    >
      <Icon name="chart" />
      <span>{id === "fly" ? "Instruments" : "Figures"}</span>
    </button>
  );
}

function PlanDrawerButton() {
  const open = drawer.value === "left";
  return (
    <button
      type="button"
      class="drawer-button"
      aria-expanded={open}
      data-testid="drawer-left"
      onClick={() => (drawer.value = open ? null : "left")}
    >
      <Icon name="menu" />
      <span>{activeView.value.label}</span>
    </button>
  );
}

/** On narrow screens the right panel is a drawer; on wide ones it is there, and takes the focus. */
function showCertificate(): void {
  if (activeView.value.id !== "plan") goTo("plan");
  else if (window.innerWidth < NARROW_PX) drawer.value = drawer.value === "right" ? null : "right";
  else document.querySelector<HTMLElement>(".panel.right .panel-scroll")?.focus();
}

export function StatusBar() {
  return (
    <header class="status-bar">
      <PlanDrawerButton />
      <Brand />
      <Tabs />
      <PlanName />
      <UndoRedo />
      <span class="spring" />
      <JobList />
      {whyObserver.value && (
        <Chip icon="eye" text="Observer" title={whyObserver.value} testid="chip-observer" />
      )}
      <LinkBadge />
      <button
        type="button"
        class="verdict-button"
        title={activeView.value.id === "plan" ? "Show the certificate" : "The open plan: show it"}
        data-testid="drawer-right"
        onClick={showCertificate}
      >
        <VerdictBadge />
      </button>
      <RightDrawerButton />
      <div class="group">
        <SoundSwitch />
        <NoticeMenu />
        <ThemeToggle />
        <Button
          kind="quiet"
          icon="user"
          title={`Signed in as ${me.value?.name ?? "…"}: accounts and sessions`}
          testid="accounts"
          onClick={() => (openDialog.value = "accounts")}
        />
        <Button
          kind="quiet"
          icon="help"
          title="Help and keys (?), pages (H)"
          testid="help"
          onClick={() => (openDialog.value = "help")}
        />
      </div>
    </header>
  );
}
