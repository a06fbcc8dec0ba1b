import type { AlertDoc } from "../messages";
import { alerts } from "../store/obstacles";
import { pending } from "../store/outcomes";
import { isReplaying } from "../store/review";
import { Button } from "../ui/Button";
import { Icon } from "../ui/Icon";
import { ErrorBox } from "../ui/ErrorBox";
import { activeView, goTo } from "../shell/views";
import { Figures, Place, State } from "./AlertFigures";
import { Announcer } from "./Announcer";
import { SensorMark } from "./SensorMark";
import { ALERTS, acknowledge } from "./commands";
import { hasWays } from "./manoeuvres";
import { alertTitle, bearingWord, distance, heightDifference } from "./words";

/** Further alerts, one line each. */
const MOST_LINES = 2;

const stageOf = (entry: AlertDoc) => (entry.over ? "over" : entry.acknowledged ? "seen" : "calling");

function Actions({ first, others }: { first: AlertDoc; others: readonly AlertDoc[] }) {
  const isBusy = pending.value.has(ALERTS);
  const unseen = [first, ...others].filter((entry) => !entry.acknowledged);
  const leadsToFly = hasWays(first) && activeView.value.id !== "fly";
  return (
    <>
      {leadsToFly && (
        <Button icon="drone" testid="alert-to-fly" onClick={() => goTo("fly")}>
          Ways past it
        </Button>
      )}
      {unseen.length > 1 && (
        <Button
          disabled={isBusy}
          title="Acknowledge all alerts"
          testid="alert-acknowledge-all"
          onClick={() => void acknowledge(null)}
        >
          All {unseen.length}
        </Button>
      )}
      {!first.acknowledged && (
        <Button
          class="acknowledge"
          icon="check"
          title="Acknowledge this alert (K)"
          disabled={isBusy}
          testid="alert-acknowledge"
          onClick={() => void acknowledge(first.alert.id)}
        >
          Acknowledge <kbd>K</kbd>
        </Button>
      )}
    </>
  );
}

function Head({ entry, isReplay }: { entry: AlertDoc; isReplay: boolean }) {
  return (
    <header>
      <Icon name={entry.over ? "check" : "warning"} size={24} />
      <SensorMark sensor={entry.alert.sensor} />
      <strong>{alertTitle(entry.alert)}</strong>
      {isReplay && <span class="replay-word small">REPLAY</span>}
      {!isReplay && isReplaying.value && <span class="live-tag">LIVE</span>}
      <State entry={entry} />
    </header>
  );
}

function Line({ entry }: { entry: AlertDoc }) {
  const { alert } = entry;
  return (
    <li class={stageOf(entry)} data-testid="alert-line">
      <Icon name="warning" size={16} />
      <SensorMark sensor={alert.sensor} />
      <span class="alert-line-text" title={alert.text}>
        {alert.obstacle
          ? `${distance(alert.obstacle.distance_m)} · ${bearingWord(alert.obstacle)} · ${heightDifference(alert.obstacle.height_difference_m)}`
          : alert.text}
      </span>
      {entry.acknowledged && <span class="muted">seen</span>}
    </li>
  );
}

/** Those that are there, line by line; of those that are over the button tells how many: the view stays free. */
function More({ others }: { others: readonly AlertDoc[] }) {
  const there = others.filter((entry) => !entry.over);
  if (there.length === 0) return null;
  const left = there.length - MOST_LINES;
  return (
    <ul class="alert-more">
      {there.slice(0, MOST_LINES).map((entry) => (
        <Line key={entry.alert.id} entry={entry} />
      ))}
      {left > 0 && <li class="muted">and {left} more</li>}
    </ul>
  );
}

/**
 * In Review a recording's alerts, unless the vehicle itself has something before it. What a recording alerts is over
 * once it has been played past: nobody has to acknowledge it.
 */
function shownAlerts(): { all: readonly AlertDoc[]; isReplay: boolean } {
  const live = alerts.live.value;
  const reviews = isReplaying.value && activeView.value.id === "review";
  if (!reviews || live.some((entry) => !entry.over)) return { all: live, isReplay: false };
  return { all: alerts.replay.value.filter((entry) => !entry.over), isReplay: true };
}

function Banner({ first, others, isReplay }: { first: AlertDoc; others: AlertDoc[]; isReplay: boolean }) {
  const { alert } = first;
  return (
    <section
      class={`alert-banner ${stageOf(first)}`}
      aria-label="Obstacle alert"
      data-testid="alert-banner"
      data-stage={stageOf(first)}
      data-sensor={alert.sensor}
    >
      <Head entry={first} isReplay={isReplay} />
      {alert.obstacle ? (
        <Figures obstacle={alert.obstacle} isOver={first.over} />
      ) : (
        <p class={alert.kind === "approach" ? `alert-figures ${first.over ? "over" : ""}` : ""}>
          {alert.text}
        </p>
      )}
      <div class="row alert-actions">
        {alert.obstacle && <Place obstacle={alert.obstacle} />}
        <span class="spring" />
        {!isReplay && <Actions first={first} others={others} />}
      </div>
      <ErrorBox place={ALERTS} />
      <More others={others} />
    </section>
  );
}

/** Over the 3D view, in every view: nothing moves when an alert begins, and no action lies beneath. */
export function AlertBanner() {
  const { all, isReplay } = shownAlerts();
  const [first, ...others] = all;
  return (
    <>
      <Announcer />
      {first && <Banner first={first} others={others} isReplay={isReplay} />}
    </>
  );
}
