import { Changes } from "../ui/Changes";
import { metres, withUnit } from "../format";
import type { AvoidanceStatus, PerceptionSettings, SeesEnough as Speeds } from "../messages";
import { document_ } from "../store/state";
import { edit } from "../store/plan";
import { obstacles, sensed, type SensorName } from "../store/obstacles";
import { SENSOR_WORDS } from "../obstacles/obstacle_words";
import { Button } from "../ui/Button";
import { Icon } from "../ui/Icon";

export interface Slowest {
  sensor: SensorName;
  depth_m: number;
  /** Rounded down to what can be ordered. */
  speed_m_s: number;
}

interface Known {
  avoidance: Pick<AvoidanceStatus, "eyes">;
  settings: PerceptionSettings;
  sees_enough: Speeds;
}

const ordered = (speed_m_s: number) => Math.max(0.3, Math.floor(10 * speed_m_s + 1e-6) / 10);

/** The sensor that sees to stop for the least speed: of those that see now, else of those that have been heard. */
export function slowestOf(
  { avoidance, settings, sees_enough }: Known,
  heard: Iterable<SensorName>,
): Slowest | null {
  const eyes = avoidance.eyes.map(({ sensor, depth_m, largest_speed_m_s }) => ({
    sensor,
    depth_m,
    speed_m_s: ordered(largest_speed_m_s),
  }));
  const set = [...heard].map((sensor) => ({
    sensor,
    depth_m: settings[`${sensor}_depth_m`],
    speed_m_s: ordered(sees_enough[sensor]),
  }));
  const all = eyes.length > 0 ? eyes : set;
  return all.reduce<Slowest | null>(
    (least, one) => (least && least.speed_m_s <= one.speed_m_s ? least : one),
    null,
  );
}

/** A plan that is faster than the sensors see to stop for says so, with the speed that would do. */
export function SeesEnough() {
  const profile = document_.value?.profile;
  const slowest = slowestOf(obstacles.live.value, sensed.live.value.keys());
  if (!profile || !slowest || profile.max_speed_m_s <= slowest.speed_m_s) return null;
  const { speed_m_s } = slowest;
  const slow = () =>
    edit("Speed that sensors see enough for", "speeds", (doc) => ({
      ...doc,
      profile: {
        ...doc.profile,
        max_speed_m_s: speed_m_s,
        mean_speed_m_s: Math.min(doc.profile.mean_speed_m_s, speed_m_s),
      },
    }));
  const speed = withUnit(speed_m_s, "m/s", 1);
  return (
    <div class="sees-enough" data-testid="sees-enough">
      <Icon name="warning" />
      <p>
        Faster than seen ahead: {SENSOR_WORDS[slowest.sensor].toLowerCase()} {metres(slowest.depth_m)} deep
        stops it from {speed}, the plan flies up to {withUnit(profile.max_speed_m_s, "m/s", 1)}.
      </p>
      <Changes>
        <Button testid="fly-as-seen" onClick={slow}>
          Fly {speed}
        </Button>
      </Changes>
    </div>
  );
}
