import type { Track, TracksMessage, TracksStatus, TraversabilityState, VelocityCone } from "../src/messages";
import { NO_GROUND } from "../src/store/traversability";

/** A few moving objects and maps of ground for the tests. */

export function track(fields: Partial<Track> = {}): Track {
  return {
    id: 12,
    enu_m: [8, 18, 20],
    velocity_enu_m_s: [-2.4, -1],
    covariance_m2: [1, 0, 1],
    age_s: 12,
    updates: 118,
    moving: true,
    range_m: 19.7,
    bearing_deg: 24,
    closest_m: 1.24,
    closest_in_s: 4.1,
    dangerous: true,
    lat_deg: 37.7290205,
    lon_deg: 14.9926236,
    remembered: false,
    ...fields,
  };
}

export const cone = (fields: Partial<VelocityCone> = {}): VelocityCone => ({
  track_id: 12,
  apex_enu_m_s: [0, 0],
  axis_deg: 0,
  half_angle_deg: 20,
  ...fields,
});

export function tracksStatus(fields: Partial<TracksStatus> = {}): TracksStatus {
  return {
    state: "running",
    text: "",
    t_mono_s: 100,
    t_utc_s: 1000,
    done_t_mono_s: 100.03,
    frames: 40,
    dropped: [],
    lost_frames: 0,
    detections: 6,
    tracks: [],
    hidden: 0,
    velocity_enu_m_s: [0, 4],
    max_speed_m_s: 8,
    safety_radius_m: 3,
    cones: [],
    room_m: [],
    proposal: null,
    no_proposal: "",
    origin: null,
    latency_s: 0.03,
    ...fields,
  };
}

export const tracksMessage = (
  status: TracksStatus | null,
  source: TracksMessage["source"] = "live",
): TracksMessage => ({ v: 1, type: "tracks", source, now_mono_s: 100.1, status });

export const ground = (fields: Partial<TraversabilityState> = {}): TraversabilityState => ({
  ...NO_GROUND,
  state: "ready",
  text: "84 % can be driven on.",
  terrain_id: "t",
  resolution_m: 0.3,
  cells: 20000,
  untraversable: 3000,
  legend: ["Hard", "Untraversable"],
  legend_colors: ["#a696d6", "#3a1c78"],
  ...fields,
});
