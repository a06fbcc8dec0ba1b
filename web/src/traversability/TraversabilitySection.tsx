import { count, metres } from "../format";
import { LIMITS, type PlanDoc, type TraversabilityState } from "../messages";
import { chooseFiles } from "../ui/choose_files";
import { radarLog } from "../store/files";
import { pending } from "../store/outcomes";
import { runningJobs } from "../store/state";
import { dismissGroundError, groundError, isGroundJob, traversability } from "../store/traversability";
import { Bar } from "../ui/Bar";
import { Button } from "../ui/Button";
import { Done, ErrorPanel } from "../ui/Outcome";
import { Icon } from "../ui/Icon";
import { Section } from "../ui/Section";
import { AutoField } from "../ui/fields";
import { Figures, Files, Layers } from "./GroundMap";
import { Fusion } from "./Fusion";
import { LandingSites } from "./LandingSites";
import { LiveRadar } from "./LiveRadar";
import { TRAVERSABILITY, putAway, resolution_m, takeRadarLogs, workOut } from "./ground_orders";

const TEACHING = "Slope and roughness of the surface model: where to drive, where to land.";

/** What is being done, how far it is, or what the map says: always at this place, and as tall. */
function Status({ state, isWorking }: { state: TraversabilityState; isWorking: boolean }) {
  const job = runningJobs.value.find(isGroundJob);
  const log = radarLog.value;
  const said = (state.state === "working" && state.text) || (log ? `Sending ${log}` : "Working it out");
  const doing = job?.step && job.step !== said ? `${said}: ${job.step}` : said;
  return (
    <div class="ground-status" role="status" data-testid="traversability-status" data-state={state.state}>
      <p class={isWorking || state.state === "ready" ? "" : "muted"}>
        {isWorking && <span class="spinner" aria-hidden="true" />}
        <span>{isWorking ? doing : state.text || TEACHING}</span>
      </p>
      {isWorking && <Bar label={doing} share={job?.progress ?? null} />}
    </div>
  );
}

function RadarLog({ state, isBusy }: { state: TraversabilityState; isBusy: boolean }) {
  const hasLog = state.uwb_log !== "";
  return (
    <div class="radar-log">
      <p>
        <Icon name="radar" size={16} />
        {hasLog ? (
          <>
            <strong class="log-name" title={state.uwb_log} data-testid="radar-log">
              {state.uwb_log}
            </strong>
            <span class="muted">{count(state.scans, "scan")}</span>
          </>
        ) : (
          <span class="muted">No radar log: foliage counts as hard.</span>
        )}
      </p>
      {state.uwb_rule !== "" && <p class="hint">{state.uwb_rule}</p>}
      {state.uwb_left_out !== "" && <p class="says-near">{state.uwb_left_out}</p>}
      <Fusion />
      <LiveRadar live={state.live} hasTerrain />
      <Button
        class="wide"
        icon="import"
        disabled={isBusy}
        title="A UWB radar's log (.npz), or a recording with its scans (.mcap): what it saw through is foliage"
        testid="radar-log-open"
        onClick={() => chooseFiles(".npz,.mcap", takeRadarLogs)}
      >
        {hasLog ? "Open another radar log…" : "Open a radar log…"}
      </Button>
    </div>
  );
}

interface Props {
  plan: PlanDoc;
  state: TraversabilityState;
  isBusy: boolean;
}

function Maps({ plan, state, isBusy }: Props) {
  return (
    <>
      <Layers state={state} />
      <Figures state={state} />
      <RadarLog state={state} isBusy={isBusy} />
      <LandingSites plan={plan} />
      <Files state={state} />
    </>
  );
}

function WorkOut({ plan, state, isBusy, hasMap }: Props & { hasMap: boolean }) {
  const again = state.uwb_log === "" ? "Work it out again" : "Work it out without the log";
  const why = plan.terrain_id === null ? "Choose a terrain first" : null;
  return (
    <>
      <AutoField
        label="Own grid"
        auto={`${LIMITS.TraversabilityBody.resolution_m.initial} m, or the model's if coarser`}
        unit="m"
        {...LIMITS.TraversabilityBody.resolution_m}
        step={0.1}
        value={resolution_m.value}
        testid="traversability-resolution"
        onChange={(value) => (resolution_m.value = value)}
      />
      <div class="row">
        <Button
          class="wide"
          icon="land"
          disabled={isBusy || why !== null}
          title={why ?? "From slope and roughness"}
          testid="work-out"
          onClick={() => void workOut()}
        >
          {hasMap ? again : "Work it out"}
        </Button>
        {hasMap && (
          <Button
            kind="quiet"
            icon="trash"
            disabled={isBusy}
            title="Put the maps away"
            testid="traversability-away"
            onClick={() => void putAway()}
          />
        )}
      </div>
    </>
  );
}

function summary({ state, cells, resolution_m: edge_m, uwb_log }: TraversabilityState): string {
  if (state === "working") return "working…";
  if (state === "failed") return "failed";
  if (cells === 0) return "not worked out";
  return `${metres(edge_m, 2)} cells${uwb_log === "" ? "" : ", cleared"}`;
}

/** Where one can drive and land: out of the surface model, cleared by a radar that sees through leaves. */
export function TraversabilitySection({ plan }: { plan: PlanDoc }) {
  const state = traversability.value;
  const isWorking = state.state === "working" || radarLog.value !== null || pending.value.has(TRAVERSABILITY);
  const hasMap = state.cells > 0;
  return (
    <Section id={TRAVERSABILITY} title="Traversability" icon="land" summary={summary(state)}>
      {groundError.value && <ErrorPanel error={groundError.value} onClose={dismissGroundError} />}
      <Status state={state} isWorking={isWorking} />
      {hasMap && <Maps plan={plan} state={state} isBusy={isWorking} />}
      <WorkOut plan={plan} state={state} isBusy={isWorking} hasMap={hasMap} />
      {!hasMap && plan.terrain_id !== null && <RadarLog state={state} isBusy={isWorking} />}
      {plan.terrain_id === null && <LiveRadar live={state.live} hasTerrain={false} />}
      <Done place={TRAVERSABILITY} />
    </Section>
  );
}
