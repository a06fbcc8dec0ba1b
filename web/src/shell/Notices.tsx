import { signal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { clock } from "../format";
import { alarms } from "../store/alarms";
import { Alarm } from "./Alarms";
import { Button } from "../ui/Button";
import { ErrorText } from "../ui/Outcome";
import { Icon } from "../ui/Icon";
import { Menu } from "../ui/Menu";
import { notices, type Notice } from "../store/state";

const SHOWN_MS = 7000;
const lastSeen = signal(0);
const dismissed = signal(0);

function NoticeIcon({ notice }: { notice: Notice }) {
  return (
    <span class={`notice-icon ${notice.level}`}>
      <Icon name={notice.level === "info" ? "info" : "warning"} />
    </span>
  );
}

/** The latest notices for a moment, at the top of the 3D view, where no control lies beneath. */
export function Toasts() {
  const latest = notices.value.filter((notice) => notice.id > dismissed.value).slice(0, 2);
  const newest = latest[0]?.id ?? 0;
  const staysOpen = latest.some((notice) => notice.level === "error");
  useEffect(() => {
    if (newest === 0 || staysOpen) return undefined;
    const timer = setTimeout(() => (dismissed.value = newest), SHOWN_MS);
    return () => clearTimeout(timer);
  }, [newest, staysOpen]);
  return (
    <div class="toasts" role="status" aria-live="polite">
      {latest.map((notice) => (
        <div class={`toast ${notice.level}`} key={notice.id} data-testid="toast">
          <NoticeIcon notice={notice} />
          <ErrorText error={notice.error} />
          <Button kind="quiet" icon="cross" title="Dismiss" onClick={() => (dismissed.value = newest)} />
        </div>
      ))}
    </div>
  );
}

/** What is wrong with the station now, and all notices since the page was opened. */
export function NoticeMenu() {
  const all = notices.value;
  const unseen =
    alarms.value.length + all.filter(({ id, level }) => id > lastSeen.value && level !== "info").length;
  return (
    <Menu
      label="Notices"
      class="notices"
      testid="notices-list"
      trigger={({ open, toggle }) => (
        <button
          type="button"
          class="button quiet bare"
          aria-expanded={open}
          aria-label={`Notices, ${unseen} new`}
          title="Notices"
          data-testid="notices"
          onClick={() => {
            lastSeen.value = all[0]?.id ?? 0;
            toggle();
          }}
        >
          <Icon name="bell" />
          {unseen > 0 && <span class="badge-count">{unseen}</span>}
        </button>
      )}
    >
      {() =>
        all.length + alarms.value.length === 0 ? (
          <p class="muted menu-empty">No notices yet.</p>
        ) : (
          <ul>
            {alarms.value.map((alarm) => (
              <li key={alarm.kind}>
                <Alarm alarm={alarm} />
              </li>
            ))}
            {all.map((notice) => (
              <li key={notice.id}>
                <NoticeIcon notice={notice} />
                <ErrorText error={notice.error} />
                <time>{clock(notice.at_ms / 1000)}</time>
              </li>
            ))}
          </ul>
        )
      }
    </Menu>
  );
}
