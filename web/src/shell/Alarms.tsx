import { clock } from "../format";
import type { AlarmDoc } from "../messages";
import { acknowledgeBreach, breach, isBreachCalling } from "../store/breach";
import { markRead, unreadAlarms } from "../store/alarms";
import { openDialog } from "../store/view";
import { Button } from "../ui/Button";
import { Icon } from "../ui/Icon";
import { ErrorText } from "../ui/Outcome";

const WAYS: Partial<Record<AlarmDoc["kind"], { label: string; dialog: "audit" | "space" }>> = {
  audit: { label: "Look at the audit log", dialog: "audit" },
  disk: { label: "Free space", dialog: "space" },
};

/** What is wrong, since when, and the way out. */
export function Alarm({ alarm, onRead }: { alarm: AlarmDoc; onRead?: () => void }) {
  const way = WAYS[alarm.kind];
  return (
    <section class={`alarm ${alarm.level}`} aria-label="Alarm" data-testid="alarm" data-kind={alarm.kind}>
      <Icon name="warning" size={24} />
      <ErrorText error={alarm.error} />
      <div class="row end">
        <time>since {clock(alarm.began_utc_s)}</time>
        {way && (
          <Button testid={`alarm-${way.dialog}`} onClick={() => (openDialog.value = way.dialog)}>
            {way.label}
          </Button>
        )}
        {onRead && (
          <Button icon="check" title="It stays among the notices" testid="alarm-read" onClick={onRead}>
            Read
          </Button>
        )}
      </div>
    </section>
  );
}

/** The vehicle has crossed its fence: what, and what it does about that. */
function BreachAlarm() {
  const error = breach.value;
  if (!error) return null;
  return (
    <section class="alarm error" aria-label="Alarm" data-testid="alarm" data-kind="fence">
      <Icon name="warning" size={24} />
      <ErrorText error={error} />
      {isBreachCalling.value && (
        <div class="row end">
          <Button
            icon="check"
            title="The sound stops; this stays"
            testid="breach-seen"
            onClick={acknowledgeBreach}
          >
            Seen
          </Button>
        </div>
      )}
    </section>
  );
}

/** Those that nobody here has read, over the 3D view and in every view. */
export function Alarms() {
  return (
    <div class="alarms" role="alert">
      <BreachAlarm />
      {unreadAlarms.value.map((alarm) => (
        <Alarm key={alarm.kind} alarm={alarm} onRead={() => markRead(alarm)} />
      ))}
    </div>
  );
}
