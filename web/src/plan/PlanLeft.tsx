import { ErrorBox } from "../ui/Outcome";
import { SeenInPlan } from "../obstacles/SeenInPlan";
import { document_ } from "../store/state";
import { TraversabilitySection } from "../traversability/TraversabilitySection";
import { PlanActions } from "./PlanActions";
import { FenceSection } from "./sections/Fence";
import { MissionSection } from "./sections/Mission";
import { PointsSection } from "./sections/Points";
import { RequiredSection } from "./sections/Required";
import { SpeedsSection } from "./sections/Speeds";
import { SurfaceSection } from "./sections/Surface";
import { TerrainSection } from "./sections/Terrain";
import { VehicleSection } from "./sections/Vehicle";

/** What the operator does: from the terrain down to the mission, and upload or export as the one primary action. */
export function PlanLeft() {
  const plan = document_.value;
  return (
    <>
      <div class="panel-scroll">
        <ErrorBox place="plan" />
        <SeenInPlan />
        {plan ? (
          <>
            <TerrainSection plan={plan} />
            <PointsSection plan={plan} />
            <VehicleSection plan={plan} />
            <SurfaceSection plan={plan} />
            <SpeedsSection plan={plan} />
            <RequiredSection plan={plan} />
            <MissionSection plan={plan} />
            <FenceSection plan={plan} />
            <TraversabilitySection plan={plan} />
          </>
        ) : (
          <p class="muted panel-empty">Loading the plan…</p>
        )}
      </div>
      <PlanActions />
    </>
  );
}
