import type { Facts } from "../src/fly/next_step";
import type {
  FlightStatus,
  FlyState,
  FollowDoc,
  LinkStatus,
  VehicleMessage,
  VehicleState,
} from "../src/messages";

/** A small flight for the tests. */

export function vehicleState(fields: Partial<VehicleState> = {}): VehicleState {
  return {
    system_id: 1,
    component_id: 1,
    autopilot: "ardupilot",
    mode: "AUTO",
    armed: true,
    critical: false,
    landed: "in_air",
    heartbeat_t_mono_s: 100,
    position_t_mono_s: 100,
    attitude_t_mono_s: 100,
    battery_t_mono_s: 100,
    gnss_t_mono_s: 100,
    gnss_fix: "rtk_fixed",
    satellites: 19,
    battery_share: 0.8,
    mission_item: 12,
    mission_items: 96,
    ...fields,
  } as VehicleState;
}

export function follow(fields: Partial<FollowDoc> = {}): FollowDoc {
  return { s_m: 10, cross_track_m: 0.1, height_error_m: 0, alt_rel_home_m: 20, ...fields } as FollowDoc;
}

export function vehicleMessage(fields: Partial<VehicleMessage> = {}): VehicleMessage {
  return {
    v: 1,
    type: "vehicle",
    source: "live",
    now_mono_s: 100.2,
    state: vehicleState(),
    follow: follow(),
    ...fields,
  };
}

export function linkStatus(fields: Partial<LinkStatus> = {}): LinkStatus {
  return {
    t_mono_s: 100,
    connections: [],
    candidates: [],
    adopted: { id: "a", address: "udpin:0.0.0.0:14550" },
    state: "live",
    silent_s: 0.1,
    quality: 0.98,
    round_trip_s: 0.04,
    warnings: [],
    ...fields,
  } as LinkStatus;
}

export function flyState(fields: Partial<FlyState> = {}): FlyState {
  return {
    onboard: {
      state: "none",
      digest: null,
      plan_name: "",
      is_open_plan: false,
      items: 0,
      rounded: [],
      rounded_note: "",
      taken_up: false,
      floor_rel_home_m: null,
      ceiling_rel_home_m: null,
    },
    preflight: null,
    checklist: null,
    resume_from_item: null,
    at_fence: "",
    taken_up: null,
    busy: "",
    can_cancel: false,
    ...fields,
  };
}

/** What the next step is told from: connected on the ground, nothing done yet. */
export const facts = (fields: Partial<Facts> = {}): Facts => ({
  link: linkStatus(),
  vehicle: vehicleState({ armed: false, landed: "on_ground" }),
  flight: { phase: "idle" } as FlightStatus,
  fly: flyState(),
  transfer: null,
  inAir: false,
  mine: true,
  accepted: new Set(),
  othersAccepted: false,
  check_age_s: 0,
  obstacle: null,
  ...fields,
});
