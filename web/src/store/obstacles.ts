import { computed, signal, type ReadonlySignal, type Signal } from "@preact/signals";
import type {
  AlertMessage,
  MapDrawn,
  ObstaclesMessage,
  ObstaclesState,
  PerceptionMessage,
  PerceptionStatus,
} from "../messages";
import { inOrder, isCalling, withAlert } from "./alerts";
import type { Source } from "./flying";
import { now_ms } from "./clock";
import { watchOf, withStatus, type Sensed } from "./sensing";

/** What sensors see and what is done about it, as the server last said: live and of a recording. */
export type SensingMessage = PerceptionMessage | AlertMessage | ObstaclesMessage;

export type SensorName = PerceptionMessage["sensor"];

export const SENSORS: readonly SensorName[] = ["radar", "vision", "ranges"];

type BySource<T> = Record<Source, T>;

export const sensed: BySource<Signal<ReadonlyMap<SensorName, Sensed>>> = {
  live: signal(new Map()),
  replay: signal(new Map()),
};

/** Until the server says more, nothing is switched on and nothing has been seen. */
const NOTHING: ObstaclesState = {
  alerts: [],
  manoeuvres: [],
  avoidance: {
    enabled: false,
    state: "off",
    text: "",
    height_offset_m: 0,
    largest_speed_m_s: null,
    sensors: [],
    eyes: [],
    by: "climb",
  },
  settings: {
    radar_depth_m: 10,
    vision_depth_m: 7,
    ranges_depth_m: 7,
    fov_deg: 24,
    height_m: 2,
    paper_bare: false,
    radar_variant: "heading_only",
    radar_azimuth_deg: 45,
    radar_low_deg: 0,
    radar_high_deg: 20,
    cloud_voxel_m: 0,
    climb_m_s: 1.5,
    comes_down: true,
    climb_ceiling_m: 30,
    vehicle_radius_m: 0.5,
    position_error_m: 0.3,
    brake_decel_m_s2: 7.5,
    brake_jerk_m_s3: 5,
    clear_count: 0,
    radar_resolution_m: 1,
    vision_resolution_m: 0.5,
    memory_limit_bytes: 1e9,
    safety_radius_m: 3,
    approach_s: 8,
    tracker: {
      coordinates: "cartesian",
      range_sigma_m: 0.15,
      bearing_sigma_deg: 1,
      bearing_edge_deg: 45,
      bearing_edge_sigma_deg: 2,
      radial_speed_sigma_m_s: 0.2,
      radial_speed_folded_m_s: 20.77,
      extent_m: 0.6,
      acceleration_m_s2: 2,
      speed_m_s: 5,
      detection_probability: 0.997,
      gate: 11.345,
      birth: 0.7,
      birth_updates: 3,
      death: 9,
      apart_m: 0.75,
    },
    velocities: {
      max_speed_m_s: 0,
      max_turn_deg: 180,
      leave_m_s: 0.3,
      nearest_only: false,
      stands_m: 2,
      stands_s: 5,
      choice: "room",
    },
  },
  sees_enough: { radar: 0, vision: 0, ranges: 0 },
  maps: [],
  seen_in_plan: 0,
  busy: "",
  stays_higher: "",
};

export const obstacles: BySource<Signal<ObstaclesState>> = {
  live: signal(NOTHING),
  replay: signal(NOTHING),
};

const ordered = (source: Source) => computed(() => inOrder(obstacles[source].value.alerts));

/** Alerts that must be seen, the most urgent first. */
export const alerts: BySource<ReadonlySignal<ReturnType<typeof inOrder>>> = {
  live: ordered("live"),
  replay: ordered("replay"),
};

export const isAlarming = computed(() => alerts.live.value.some(isCalling));

/** Told once: its values change ten times a second. */
export const hasSensors: BySource<ReadonlySignal<boolean>> = {
  live: computed(() => sensed.live.value.size > 0),
  replay: computed(() => sensed.replay.value.size > 0),
};

/** The last words of the sensors that watch now, whose word counts. */
export const watching = (source: Source): PerceptionStatus[] =>
  SENSORS.flatMap((sensor) => {
    const entry = sensed[source].value.get(sensor);
    const watches = entry && watchOf(entry, source === "live", now_ms.value) === "running";
    return entry && watches ? [entry.status] : [];
  });

export type MapName = MapDrawn["sensor"];

export const drawnOf = (source: Source, name: MapName): MapDrawn | null =>
  obstacles[source].value.maps.find((entry) => entry.sensor === name) ?? null;

export function forgetSensing(source: Source): void {
  sensed[source].value = new Map();
}

export function forgetObstacles(source: Source): void {
  obstacles[source].value = NOTHING;
}

/** Takes one message about obstacles. */
export function takeSensing(message: SensingMessage, received_ms: number): void {
  switch (message.type) {
    case "perception":
      takePerception(message, received_ms);
      return;
    case "alert": {
      const known = obstacles[message.source];
      known.value = withAlert(known.value, message.alert);
      return;
    }
    case "obstacles":
      obstacles[message.source].value = message.obstacles;
  }
}

function takePerception(message: PerceptionMessage, received_ms: number): void {
  const known = sensed[message.source];
  const next = new Map(known.value);
  const { sensor, status } = message;
  if (status) next.set(sensor, withStatus(next.get(sensor), { ...message, status }, received_ms));
  else next.delete(sensor);
  known.value = next;
}
