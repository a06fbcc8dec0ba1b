/** The sensor that sees to stop for the least speed: of those that see now, else of those that have been heard. */
import type { AvoidanceStatus, PerceptionSettings, SeesEnough } from "../messages";
import type { SensorName } from "../store/obstacles";

export interface Slowest {
  sensor: SensorName;
  depth_m: number;
  /** Rounded down to what can be ordered. */
  speed_m_s: number;
}

interface Known {
  avoidance: Pick<AvoidanceStatus, "eyes">;
  settings: PerceptionSettings;
  sees_enough: SeesEnough;
}

const ordered = (speed_m_s: number) => Math.max(0.3, Math.floor(10 * speed_m_s + 1e-6) / 10);

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
