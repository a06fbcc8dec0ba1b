import {
  CHECK_FRESH_S,
  type CheckRow,
  type FlightStatus,
  type FlyState,
  type LinkStatus,
  type TransferStatus,
  type VehicleState,
} from "../messages";
import { checklistObstacle } from "../store/checklist";
import { isAcceptable, resumeObstacle, type Accepted } from "../vehicle/orders";

/** What the page knows when it says what comes next. */
export interface Facts {
  link: LinkStatus | null;
  vehicle: VehicleState | null;
  flight: FlightStatus | null;
  fly: FlyState | null;
  transfer: TransferStatus | null;
  inAir: boolean;
  mine: boolean;
  accepted: ReadonlySet<Accepted>;
  /** What is said of other vehicles where a plan was taken up is accepted. */
  othersAccepted: boolean;
  /** How long ago the start was checked. */
  check_age_s: number;
  /** Why the open plan cannot be uploaded now; null: it can. */
  obstacle: string | null;
}

/** The one thing to do next; `why` says why it cannot be done yet, or what it waits for. */
export type Step =
  | { id: "simulator" | "adopt" | "again" | "take_control"; why?: string }
  | { id: "upload" | "check" | "start" | "pause" | "resume"; why?: string }
  | { id: "wait"; why: string };

export const openChecks = (rows: readonly CheckRow[]) =>
  rows.filter((row) => row.state === "bad" || row.state === "unknown");

export const unaccepted = (rows: readonly CheckRow[], accepted: ReadonlySet<Accepted>) =>
  rows.filter((row) => row.state === "accept" && !(isAcceptable(row.code) && accepted.has(row.code)));

export const ROW_TITLES: Record<CheckRow["code"], string> = {
  mission: "Mission",
  clearance: "Clearance",
  home: "Home",
  gnss: "GNSS",
  rtl_height: "Return height",
  battery: "Battery",
  ready: "Ready to arm",
  avoidance: "Avoidance",
  fence: "Fence",
  others: "Other vehicles",
};

const titles = (rows: readonly CheckRow[]) => rows.map((row) => ROW_TITLES[row.code]).join(", ");

/** A connection that waits is given its time; the simulator stays at hand above. */
function connecting(link: LinkStatus | null): Step {
  if (link?.candidates.length) return { id: "adopt" };
  const isWaiting = link?.connections.some((connection) => connection.state !== "failed");
  return isWaiting ? { id: "wait", why: "Waiting for a vehicle…" } : { id: "simulator" };
}

function inFlight(facts: Facts): Step | null {
  const phase = facts.flight?.phase ?? "idle";
  if (phase === "arming") return { id: "wait", why: "Arming…" };
  if (phase === "taking_off") return { id: "pause" };
  if (phase === "flying") return { id: "pause" };
  if (phase === "paused" && facts.flight?.is_flown) return { id: "wait", why: "Choose the next way" };
  if (phase === "paused") {
    const why =
      facts.flight?.not_resumed || resumeObstacle(facts.fly?.taken_up?.others, facts.othersAccepted);
    return why === undefined ? { id: "resume" } : { id: "resume", why };
  }
  if (phase === "returning") return { id: "wait", why: "On the way home" };
  if (!facts.inAir) return null;
  return { id: "wait", why: `In the air in ${facts.vehicle?.mode || "an unknown mode"}, not by Hedgehop` };
}

function onGround(facts: Facts): Step {
  const { fly, accepted, obstacle } = facts;
  const onboard = fly?.onboard;
  if (onboard?.state !== "verified" || onboard.taken_up || (!onboard.is_open_plan && obstacle === null)) {
    return obstacle ? { id: "upload", why: obstacle } : { id: "upload" };
  }
  const rows = fly?.preflight?.rows;
  if (!rows) return { id: "check" };
  if (facts.check_age_s > CHECK_FRESH_S) return { id: "check", why: "The check is older than two minutes" };
  const open = openChecks(rows);
  if (open.length > 0)
    return { id: "check", why: `Mend what stands above, then check again: ${titles(open)}` };
  const left = unaccepted(rows, accepted);
  if (left.length > 0) return { id: "start", why: `Tick what you accept first: ${titles(left)}` };
  const unticked = checklistObstacle(fly?.checklist);
  return unticked === null ? { id: "start" } : { id: "start", why: unticked };
}

export function nextStep(facts: Facts): Step {
  const { link, transfer, fly } = facts;
  if (!facts.mine) return { id: "take_control" };
  if (!link?.adopted) return connecting(link);
  // The vehicle may be flying without anybody who can command it: nothing comes before that.
  if (link.again) return { id: "again" };
  if (transfer?.phase === "sending" || transfer?.phase === "reading_back" || fly?.busy) {
    return { id: "wait", why: fly?.busy || "Talking to the vehicle" };
  }
  return inFlight(facts) ?? onGround(facts);
}

/** What may be said beside the next step. */
export interface Known {
  /** Why nothing comes to the vehicle (`whyUnheard`). */
  readonly unheard: string | null;
  readonly hint: string;
  /** Who is in charge, if another page is. */
  readonly holder: string | null;
  readonly isServerHeard: boolean;
}

/** The words beside the next step: of a flight that this page cannot hear it says nothing but why. */
export function wordsBeside(step: Step, { unheard, hint, holder, isServerHeard }: Known): string[] {
  const reason = "why" in step && step.id !== "wait" ? step.why : "";
  return [
    unheard === null ? hint : "",
    unheard ?? reason ?? "",
    step.id === "take_control" && isServerHeard ? (holder ?? "") : "",
  ].filter((words) => words !== "");
}
