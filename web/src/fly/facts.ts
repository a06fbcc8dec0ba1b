import { now_ms } from "../store/clock";
import { fly, flight, isInAir, lease, linkStatus, transfer, vehicle } from "../store/flying";
import { verdictOf } from "../store/results";
import { isFresh, plan } from "../store/state";
import { accepted } from "./commands";
import { nextStep, uploadObstacle, type Step } from "./next_step";

/** Why the open plan cannot be uploaded now. */
export const obstacle = () => uploadObstacle(verdictOf(plan.value, isFresh.value));

function checkAge_s(): number {
  const checked_ms = Date.parse(fly.value?.preflight?.checked_utc ?? "");
  const age_s = (performance.timeOrigin + now_ms.value - checked_ms) / 1000;
  return Number.isFinite(age_s) ? age_s : 0;
}

/** What comes next, by what is known now. */
export const presentStep = (): Step =>
  nextStep({
    link: linkStatus.value?.status ?? null,
    vehicle: vehicle.value,
    flight: flight.live.value,
    fly: fly.value,
    transfer: transfer.value,
    inAir: isInAir.value,
    mine: lease.value.mine,
    accepted: accepted.value,
    check_age_s: checkAge_s(),
    obstacle: obstacle(),
  });
