import { Changes } from "../ui/Changes";
import { useRef, useState } from "preact/hooks";
import type { AlertDoc, ObstacleAlert } from "../messages";
import { endingsOf, parted, type Endings } from "../store/alerts";
import { now_ms } from "../store/clock";
import { alerts } from "../store/obstacles";
import { pending } from "../store/outcomes";
import { failed } from "../store/reach";
import { serverNow_s } from "../store/server_clock";
import { isReplaying } from "../store/review";
import { Button } from "../ui/Button";
import { Icon } from "../ui/Icon";
import { ErrorBox } from "../ui/Outcome";
import { goTo, viewId } from "../store/view";
import { Figures, Place, State } from "./AlertFigures";
import { SensorMark } from "./SensorMark";
import { ALERTS, acknowledge } from "./obstacle_orders";
import { hasWays } from "./manoeuvres";
import {
  alertSensor,
  alertTitle,
  bearingWord,
  distance,
  heightDifference,
  lateAlert_s,
  seenAgo,
  spoken,
} from "./obstacle_words";

/** Further alerts, one line each. */
const MOST_LINES = 2;

/** Says each alert once when it begins and once when it is over; figures that go on changing are not read out. */
function Announcer() {
  const told = useRef({ key: "", text: "" });
  const first = alerts.live.value[0];
  const key = first ? `${first.alert.id} ${first.over}` : "";
  if (key !== told.current.key) told.current = { key, text: first ? spoken(first) : "" };
  return (
    <p class="visually-hidden" role="alert" aria-live="assertive" data-testid="alert-spoken">
      {told.current.text}
    </p>
  );
}

const stageOf = (entry: AlertDoc) => (entry.over ? "over" : entry.acknowledged ? "seen" : "calling");

function Actions({ first, others }: { first: AlertDoc; others: readonly AlertDoc[] }) {
  const isBusy = pending.value.has(ALERTS);
  const unseen = [first, ...others].filter((entry) => !entry.acknowledged);
  const leadsToFly = hasWays(first) && viewId.value !== "fly";
  return (
    <>
      {leadsToFly && (
        <Button icon="drone" testid="alert-to-fly" onClick={() => goTo("fly")}>
          Ways past it
        </Button>
      )}
      <Changes>
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
      </Changes>
    </>
  );
}

interface HeadProps {
  entry: AlertDoc;
  isReplay: boolean;
  /** Back to a chip. */
  onShrink: (() => void) | null;
}

function AlertMark({ alert }: { alert: ObstacleAlert }) {
  const sensor = alertSensor(alert);
  return sensor && <SensorMark sensor={sensor} />;
}

function Head({ entry, isReplay, onShrink }: HeadProps) {
  return (
    <header>
      <Icon name={entry.over ? "check" : "warning"} size={24} />
      <AlertMark alert={entry.alert} />
      <strong>{alertTitle(entry.alert)}</strong>
      {isReplay && <span class="replay-word small">REPLAY</span>}
      {!isReplay && isReplaying.value && <span class="live-tag">LIVE</span>}
      <State entry={entry} />
      {onShrink && (
        <Button
          kind="quiet"
          icon="cross"
          title="Back to a chip; it stays unacknowledged"
          testid="alert-shrink"
          onClick={onShrink}
        />
      )}
    </header>
  );
}

/** In a recording nothing is late. */
const late_s = ({ alert, over }: AlertDoc, isReplay: boolean) =>
  isReplay || over ? null : lateAlert_s(alert, serverNow_s(now_ms.value));

function Line({ entry, isReplay }: { entry: AlertDoc; isReplay: boolean }) {
  const { alert } = entry;
  const ago_s = late_s(entry, isReplay);
  return (
    <li class={stageOf(entry)} data-testid="alert-line">
      <Icon name="warning" size={16} />
      <AlertMark alert={alert} />
      <span class="alert-line-text" title={alert.text}>
        {alert.obstacle
          ? `${distance(alert.obstacle.distance_m)} · ${bearingWord(alert.obstacle)} · ${heightDifference(alert.obstacle.height_difference_m)}`
          : alert.text}
      </span>
      {ago_s !== null && alert.obstacle && <span class="muted">{seenAgo(ago_s)}</span>}
      {ago_s === null && entry.acknowledged && <span class="muted">seen</span>}
    </li>
  );
}

/** Those that are there, line by line; of those that are over the button tells how many: the view stays free. */
function More({ others, isReplay }: { others: readonly AlertDoc[]; isReplay: boolean }) {
  const there = others.filter((entry) => !entry.over);
  if (there.length === 0) return null;
  const left = there.length - MOST_LINES;
  return (
    <ul class="alert-more">
      {there.slice(0, MOST_LINES).map((entry) => (
        <Line key={entry.alert.id} entry={entry} isReplay={isReplay} />
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
  const reviews = isReplaying.value && viewId.value === "review";
  if (!reviews || live.some((entry) => !entry.over)) return { all: live, isReplay: false };
  return { all: alerts.replay.value.filter((entry) => !entry.over), isReplay: true };
}

interface BannerProps extends Omit<HeadProps, "entry"> {
  first: AlertDoc;
  others: readonly AlertDoc[];
}

function Banner({ first, others, isReplay, onShrink }: BannerProps) {
  const { alert } = first;
  return (
    <section
      class={`alert-banner ${stageOf(first)}`}
      aria-label="Obstacle alert"
      data-testid="alert-banner"
      data-stage={stageOf(first)}
      data-sensor={alert.sensor}
    >
      <Head entry={first} isReplay={isReplay} onShrink={onShrink} />
      {alert.obstacle ? (
        <Figures obstacle={alert.obstacle} isOver={first.over} late_s={late_s(first, isReplay)} />
      ) : (
        <p
          class={
            alert.kind === "approach" || alert.kind === "traffic"
              ? `alert-figures ${first.over ? "over" : ""}`
              : ""
          }
        >
          {alert.text}
        </p>
      )}
      {!isReplay && failed.value === "server" && <p class="alert-old">Old: nothing new is heard of it.</p>}
      <div class="row alert-actions">
        {alert.obstacle && <Place obstacle={alert.obstacle} />}
        <span class="spring" />
        {!isReplay && <Actions first={first} others={others} />}
      </div>
      <ErrorBox place={ALERTS} />
      <More others={others} isReplay={isReplay} />
    </section>
  );
}

/** Nobody has acknowledged them, and nothing is there any more. */
function Chip({ over, onOpen }: { over: readonly AlertDoc[]; onOpen: () => void }) {
  return (
    <button
      type="button"
      class="alert-chip"
      title="Show what was alerted and is over; K acknowledges it"
      data-testid="alert-chip"
      onClick={onOpen}
    >
      <Icon name="check" size={16} />
      <b class="number">{over.length}</b> {over.length === 1 ? "alert" : "alerts"} over
    </button>
  );
}

/** Over the 3D view, in every view: nothing moves when an alert begins, and no action lies beneath. */
export function AlertBanner() {
  const { all, isReplay } = shownAlerts();
  const endings = useRef<Endings>(new Map());
  const [isOpen, setOpen] = useState(false);
  const at_ms = all.some((entry) => entry.over) ? now_ms.value : now_ms.peek();
  endings.current = endingsOf(endings.current, all, at_ms);
  const { banner, chip } = parted(all, endings.current, at_ms);
  const isUnfolded = isOpen && banner.length === 0;
  if (isOpen && (banner.length > 0 || chip.length === 0)) setOpen(false);
  const [first, ...others] = isUnfolded ? chip : banner;
  return (
    <>
      <Announcer />
      {first && (
        <Banner
          first={first}
          others={isUnfolded ? others : [...others, ...chip]}
          isReplay={isReplay}
          onShrink={isUnfolded ? () => setOpen(false) : null}
        />
      )}
      {chip.length > 0 && !isUnfolded && <Chip over={chip} onOpen={() => setOpen(true)} />}
    </>
  );
}
