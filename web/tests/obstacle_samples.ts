import type {
  AlertDoc,
  ManoeuvreDoc,
  Obstacle,
  ObstacleAlert,
  ObstaclesState,
  PerceptionMessage,
  PerceptionStatus,
} from "../src/messages";
import { obstacles } from "../src/store/obstacles";

/** A few obstacles for the tests. */

const NOTHING: ObstaclesState = obstacles.live.peek();

export function obstacle(fields: Partial<Obstacle> = {}): Obstacle {
  return {
    region: "roi",
    distance_m: 8.6,
    bearing_deg: 32,
    off_nose_deg: -3,
    height_difference_m: 3.2,
    time_to_contact_s: 4.1,
    enu_m: [3, 8, 1],
    lat_deg: 37.7290205,
    lon_deg: 14.9926236,
    alt_amsl_m: 1720.3,
    voxels: 14,
    size_m: [2, 3, 6],
    ...fields,
  };
}

export function alert(id: string, fields: Partial<ObstacleAlert> = {}): ObstacleAlert {
  return {
    id,
    sensor: "radar",
    kind: "obstacle",
    phase: "begins",
    t_mono_s: 100,
    t_utc_s: 1000,
    done_t_mono_s: 100.1,
    text: "Radar: obstacle 8.6 m ahead",
    obstacle: obstacle(),
    ...fields,
  };
}

export const alertDoc = (id: string, fields: Partial<AlertDoc> = {}): AlertDoc => ({
  alert: alert(id),
  began_utc_s: 1000,
  over: false,
  acknowledged: false,
  ...fields,
});

export const obstaclesState = (fields: Partial<ObstaclesState> = {}): ObstaclesState => ({
  ...NOTHING,
  ...fields,
});

export function perception(fields: Partial<PerceptionStatus> = {}): PerceptionStatus {
  return {
    sensor: "radar",
    state: "running",
    placed: true,
    flight_map: null,
    text: "",
    t_mono_s: 100,
    t_utc_s: 1000,
    done_t_mono_s: 100.06,
    frames: 10,
    dropped: [],
    lost_frames: 0,
    points: 120,
    voxels_occupied: 12430,
    voxels_explained: 220,
    map_bytes: 1e6,
    map_revision: 3,
    clear_count: 0,
    origin: null,
    region: null,
    corridor_m: 24,
    corridor_occupied: false,
    obstacles: [],
    sweep_m: Array<null>(72).fill(null),
    conflict: null,
    divergence_m: null,
    latency_s: 0.062,
    basis: null,
    ...fields,
  };
}

export const perceptionMessage = (
  status: PerceptionStatus,
  fields: Partial<PerceptionMessage> = {},
): PerceptionMessage & { status: PerceptionStatus } => ({
  v: 1,
  type: "perception",
  source: "live",
  now_mono_s: status.t_mono_s + 0.1,
  sensor: status.sensor,
  ...fields,
  status,
});

export const manoeuvre = (
  id: string,
  kind: ManoeuvreDoc["kind"],
  fields: Partial<ManoeuvreDoc> = {},
): ManoeuvreDoc => ({
  id,
  kind,
  for_alert: "a",
  possible: true,
  text: "",
  clearance_m: 3.217,
  length_m: 34,
  seconds: 12,
  climb_m: 6,
  top_unseen: false,
  ...fields,
});
